// How the parameters of a store change: parameter_store.hpp has the steps.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/nodes/parameter_store.hpp"

namespace takt {
namespace {

// Another thread may change values while callbacks check theirs: then these are checked again.
// Limit: attempts to set parameters while other threads set some. At it: the change is refused.
// Seen: the result of the call.
constexpr int kMostAttempts = 10;
// Changes that are stored, and wait for the post-set callbacks of an earlier change.
// Limit: changes of parameters that wait for post-set callbacks. At it: the next change is refused.
// Seen: the error.
constexpr std::size_t kMostFinished = 1000;

}  // namespace

// The stores whose callbacks have led this thread to its change. They need not be on its stack, as
// another thread may report a change that waits. A callback must not change its own store: the
// change would call the callback again, without end.
class ParameterStore::Cause {
 public:
  Cause(const ParameterStore& store, std::string_view what)
      : stores_(current()), outer_(innermost_) {
    if (std::find(stores_.begin(), stores_.end(), store.id_) != stores_.end()) {
      throw Error(fmt::format("node '{}': a callback of parameters {}", store.node_, what),
                  "do it after the callback");
    }
    stores_.push_back(store.id_);
    innermost_ = this;
  }
  explicit Cause(const Change& change) : stores_(change.causes), outer_(innermost_) {
    innermost_ = this;
  }
  ~Cause() { innermost_ = outer_; }
  Cause(const Cause&) = delete;
  Cause& operator=(const Cause&) = delete;

  static std::vector<std::uint64_t> current() {
    return innermost_ != nullptr ? innermost_->stores_ : std::vector<std::uint64_t>();
  }

 private:
  std::vector<std::uint64_t> stores_;
  const Cause* const outer_;
  static thread_local constinit const Cause* innermost_;
};
thread_local constinit const ParameterStore::Cause* ParameterStore::Cause::innermost_ = nullptr;

std::uint64_t ParameterStore::next_id() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

std::string ParameterStore::disturbed() const {
  return fmt::format(
      "node '{}': other threads have changed its parameters {} times while callbacks checked the "
      "values",
      node_, kMostAttempts);
}

ParameterValue ParameterStore::declare(std::string_view name, ParameterValue wanted,
                                       ParameterDescriptor descriptor,
                                       const detail::IntegerLimits& limits) {
  const Cause cause(*this, "declares one");
  const Declared declared{std::move(wanted), std::move(descriptor), limits};
  std::optional<ParameterValue> value;
  for (int i = 0; i < kMostAttempts && !value; ++i) value = try_to_declare(name, declared);
  if (!value) throw Error(disturbed(), "declare parameters before other threads set some");
  call_post_set();
  return *value;
}

std::optional<ParameterValue> ParameterStore::try_to_declare(std::string_view name,
                                                             const Declared& wanted) {
  Lock lock(change_mutex_);
  const std::uint64_t version = version_;
  if (has(name)) {
    throw Error(fmt::format("parameter '{}' of node '{}' is declared twice", name, node_));
  }
  check_backlog();
  check_descriptor(name, wanted);
  ParameterValue value = accepted(name, wanted.value, wanted);
  if (const auto given = given_.find(name); given != given_.end()) {
    value = accepted(name, given->second, {value, wanted.descriptor, wanted.limits});
  }
  // As in rclcpp, a parameter without a value is declared without calling callbacks.
  const bool is_set = !std::holds_alternative<std::monostate>(value);
  Parameters values;
  if (is_set) values.try_emplace(std::string(name), value);
  const SetParametersResult result = is_set ? ask_callbacks(lock, values) : SetParametersResult();
  if (!result.successful) {
    throw Error(fmt::format("parameter '{}' of node '{}' cannot be {}: {}", name, node_,
                            to_string(value), result.reason));
  }
  if (version_ != version) return std::nullopt;
  {
    const std::lock_guard reading(mutex_);
    declared_.try_emplace(std::string(name), Declared{value, wanted.descriptor, wanted.limits});
    if (const auto found = unused_.find(name); found != unused_.end()) unused_.erase(found);
  }
  ++version_;
  const ParameterChanges changes{.added = values};
  if (is_set) report(changes, std::move(values));
  return value;
}

void ParameterStore::undeclare(std::string_view name) {
  const Cause cause(*this, "undeclares one");
  const Lock lock(change_mutex_);
  {
    const std::lock_guard reading(mutex_);
    check_undeclaring(name, find(name));
  }
  ParameterChanges changes{.deleted = {std::string(name)}};
  apply(changes);
  report(changes, {});
}

SetParametersResult ParameterStore::set_atomically(const Parameters& values) {
  const Cause cause(*this, "sets one");
  std::optional<SetParametersResult> result;
  for (int i = 0; i < kMostAttempts && !result; ++i) result = try_to_set(values);
  if (!result) return {false, disturbed()};
  if (result->successful) call_post_set();
  return *std::move(result);
}

std::optional<SetParametersResult> ParameterStore::try_to_set(Parameters values) {
  Lock lock(change_mutex_);
  const std::uint64_t version = version_;
  each(lock, pre_set_, [&](const auto& callback) {
    callback(values);
    return true;
  });
  if (values.empty()) {
    return SetParametersResult{
        false,
        fmt::format("node '{}': no parameter is given, or a callback has removed all", node_)};
  }
  ParameterChanges changes;
  try {
    check_backlog();
    changes = checked(values);
    if (check_) check_(changes.changed);  // the node's own check
  } catch (const Error& error) {
    return SetParametersResult{false, error.what()};
  }
  // Callbacks get the values as they are stored; an undeclared parameter's value is not set.
  for (const auto& [name, value] : changes.changed) values[name] = value;
  if (SetParametersResult result = ask_callbacks(lock, values); !result.successful) return result;
  if (version_ != version) return std::nullopt;
  apply(changes);
  report(changes, std::move(values));
  return SetParametersResult();
}

std::vector<SetParametersResult> ParameterStore::set(const std::vector<Parameter>& parameters) {
  std::vector<SetParametersResult> results;
  for (const auto& [name, value] : parameters) results.push_back(set_atomically({{name, value}}));
  return results;
}

void ParameterStore::check_backlog() const {
  if (finished_.size() < kMostFinished) return;
  throw Error(fmt::format("node '{}': a post-set callback has not returned yet, and {} changes "
                          "wait for theirs",
                          node_, kMostFinished),
              "try it again, and let post-set callbacks return sooner");
}

// Replaced and deleted values are freed after the inner unlock, for which readers wait.
void ParameterStore::apply(ParameterChanges changes) {
  ++version_;
  std::vector<decltype(declared_)::node_type> deleted;
  const std::lock_guard lock(mutex_);
  for (auto& [name, value] : changes.added) {
    declared_.try_emplace(name, Declared{std::move(value), {.dynamic_typing = true}, {}});
  }
  for (auto& [name, value] : changes.changed) {
    std::swap(declared_.find(name)->second.value, value);
  }
  for (const std::string& name : changes.deleted) deleted.push_back(declared_.extract(name));
}

// The listener is called at once: it waits for no callback, and misses no change when one throws.
void ParameterStore::report(const ParameterChanges& changes, Parameters values) {
  if (listener_) listener_(changes);
  if (!values.empty()) finished_.push_back({std::move(values), Cause::current()});
}

// All callbacks are called even if one throws; the first exception is thrown at the end.
void ParameterStore::call_post_set() {
  std::exception_ptr exception;
  const auto call = [&](const auto& callback, const Parameters& values) {
    try {
      callback(values);
    } catch (...) {
      if (exception != nullptr) {
        log(LogLevel::error, "node '{}': a post-set callback threw, too: {}", node_,
            text_of(std::current_exception()));
      } else {
        exception = std::current_exception();
      }
    }
    return true;
  };
  Lock lock(change_mutex_);
  if (std::exchange(calls_post_set_, true)) return;
  const struct End {  // whatever throws
    ParameterStore& parameters;
    Lock& lock;
    ~End() {
      if (!lock.owns_lock()) lock.lock();
      parameters.calls_post_set_ = false;
      lock.unlock();
    }
  } end{*this, lock};
  while (!finished_.empty()) {
    const Change change = std::move(finished_.front());
    finished_.pop_front();
    const Cause cause(change);
    lock.unlock();
    if (act_) call(act_, change.values);
    lock.lock();
    each(lock, post_set_, [&](const auto& callback) { return call(callback, change.values); });
  }
  if (exception != nullptr) std::rethrow_exception(exception);
}

void ParameterStore::set_listener(ParametersListener listener) {
  const Lock lock(change_mutex_);
  listener_.swap(listener);
}

template <class List, class Use>
void ParameterStore::each(Lock& lock, List& callbacks, Use&& use) {
  if (callbacks.empty()) return;  // without callbacks, the lock is kept
  lock.unlock();
  callbacks.each(List::Order::last_added, std::forward<Use>(use));
  lock.lock();
}

SetParametersResult ParameterStore::ask_callbacks(Lock& lock, const Parameters& values) {
  SetParametersResult result;
  each(lock, on_set_, [&](const auto& callback) {
    result = callback(values);
    return result.successful;
  });
  return result;
}

}  // namespace takt
