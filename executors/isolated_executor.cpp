// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/isolated_executor.hpp"

#include <algorithm>

namespace takt {

/// Between begin and end of a spin, of whatever kind, this is the only one.
class IsolatedExecutor::Spin {
 public:
  explicit Spin(IsolatedExecutor& executor) : executor_(executor) {
    if (executor_.spinning_.exchange(true)) {
      throw Error("executor '" + executor_.options_.name + "' is spinning already");
    }
  }
  ~Spin() {
    executor_.backend_->leave(0);
    executor_.cancelled_.store(false);
    executor_.spinning_.store(false);
  }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

 private:
  IsolatedExecutor& executor_;
};

IsolatedExecutor::IsolatedExecutor(const ExecutorOptions& options)
    : options_(options), backend_(make_wait_backend(*options.clock, 1)) {
  for (const ThreadAttributes& thread : options.threads) thread.check();
  if (!options.scheduler.empty()) schedulers().check(options.scheduler);
}

// ---- Children ----

std::shared_ptr<IsolatedExecutor::Child> IsolatedExecutor::find(const Node& node) const {
  const std::lock_guard lock(mutex_);
  const auto child = std::find_if(children_.begin(), children_.end(), [&](const auto& candidate) {
    return candidate->node.lock().get() == &node;
  });
  return child == children_.end() ? nullptr : *child;
}

std::shared_ptr<IsolatedExecutor::Child> IsolatedExecutor::find_or_make(
    const std::shared_ptr<Node>& node) {
  if (auto child = find(*node)) return child;
  const std::lock_guard lock(mutex_);
  ExecutorOptions options = options_;
  options.name = node->name();
  options.threads.clear();
  ThreadAttributes thread;
  if (!options_.threads.empty()) {
    thread = options_.threads[children_.size() % options_.threads.size()];
  }
  thread.name = node->name();
  options.threads.push_back(thread);
  children_.push_back(std::make_shared<Child>(options, node));
  return children_.back();
}

std::vector<std::shared_ptr<IsolatedExecutor::Child>> IsolatedExecutor::children() const {
  const std::lock_guard lock(mutex_);
  return children_;
}

void IsolatedExecutor::add_node(const std::shared_ptr<Node>& node) {
  const std::shared_ptr<Child> child = find_or_make(node);
  child->executor.add_node(node);
  start(*child);
  wake();
}

void IsolatedExecutor::add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                          const std::shared_ptr<Node>& node) {
  const std::shared_ptr<Child> child = find_or_make(node);
  child->executor.add_callback_group(group, node);
  start(*child);
  wake();
}

void IsolatedExecutor::remove_node(const std::shared_ptr<Node>& node) {
  const std::shared_ptr<Child> child = find(*node);
  if (child == nullptr) {
    throw Error("node '" + node->fully_qualified_name() + "' does not belong to executor '" +
                options_.name + "'");
  }
  child->executor.remove_node(node);
  // In a callback of the node the child cannot be joined; it then ends with the executor.
  if (child->thread.get_id() == std::this_thread::get_id()) return;
  stop(*child);
  const std::lock_guard lock(mutex_);
  std::erase(children_, child);
}

void IsolatedExecutor::remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                             const std::shared_ptr<Node>& node) {
  const std::shared_ptr<Child> child = find(*node);
  if (child == nullptr) {
    throw Error("node '" + node->fully_qualified_name() + "' does not belong to executor '" +
                options_.name + "'");
  }
  child->executor.remove_callback_group(group, node);
}

// Starts the child's thread, if children have threads now and this one has none yet.
void IsolatedExecutor::start(Child& child) {
  const std::lock_guard lock(mutex_);
  if (!runs_children_ || child.thread.joinable()) return;
  child.thread = std::thread([this, &child, handler = handler_] {
    try {
      child.executor.spin(handler);
    } catch (...) {
      {
        const std::lock_guard exception_lock(mutex_);
        if (exception_ == nullptr) exception_ = std::current_exception();
      }
      cancel();
    }
  });
}

void IsolatedExecutor::stop(Child& child) noexcept {
  if (!child.thread.joinable()) return;
  child.executor.cancel();
  child.thread.join();
}

// ---- Spinning ----

void IsolatedExecutor::wake() noexcept {
  if (!has_news_.exchange(true)) backend_->post();
}

void IsolatedExecutor::cancel() noexcept {
  cancelled_.store(true);
  wake();
}

void IsolatedExecutor::spin(const ExceptionHandler& handler) {
  const Spin spin(*this);
  if (cancelled_.load()) return;
  {
    const std::lock_guard lock(mutex_);
    handler_ = handler;
    runs_children_ = true;
  }
  for (const auto& child : children()) start(*child);
  while (!cancelled_.load()) {
    backend_->wait(0, kNever);
    has_news_.store(false);
  }
  {
    const std::lock_guard lock(mutex_);
    runs_children_ = false;
  }
  // All are told before any is waited for. Under a manual clock, give way to those who must end.
  for (const auto& child : children()) {
    if (child->thread.joinable()) child->executor.cancel();
  }
  backend_->leave(0);
  for (const auto& child : children()) {
    if (child->thread.joinable()) child->thread.join();
    child->executor.forget_cancel();
  }
  const std::lock_guard lock(mutex_);
  if (exception_ != nullptr) std::rethrow_exception(std::exchange(exception_, nullptr));
}

bool IsolatedExecutor::run_one() {
  for (const auto& child : children()) {
    if (child->executor.run_one()) return true;
  }
  return false;
}

/// Runs the children in turn on the calling thread until done() or the limit; done is asked before
/// every callback, and each time something wakes us.
template <class Done>
void IsolatedExecutor::run_on_caller(TimePoint limit, Done&& done) {
  for (const auto& child : children()) child->executor.set_observer(this);
  const auto stop_observing = [this](void*) {
    for (const auto& child : children()) child->executor.set_observer(nullptr);
    wait_for_readers();
  };
  const std::unique_ptr<void, decltype(stop_observing)> guard(this, stop_observing);
  while (!cancelled_.load() && !done()) {
    has_news_.store(false);
    if (run_one()) continue;
    TimePoint deadline = limit;
    for (const auto& child : children()) {
      child->executor.set_observer(this);  // it may be new
      deadline = std::min(deadline, child->executor.next_release());
    }
    if (cancelled_.load() || done()) return;
    if (!backend_->wait(0, deadline) && options_.clock->now() >= limit) return;
  }
}

void IsolatedExecutor::spin_once(Nanoseconds timeout) {
  const Spin spin(*this);
  if (run_one() || cancelled_.load()) return;
  const TimePoint limit = timeout < Nanoseconds::zero() ? kNever : options_.clock->now() + timeout;
  bool has_run = false;
  run_on_caller(limit, [&] { return has_run || (has_run = run_one()); });
}

void IsolatedExecutor::spin_some(Nanoseconds max_duration) {
  const Spin spin(*this);
  const TimePoint start = options_.clock->now();
  for (const auto& child : children()) {
    if (cancelled_.load()) return;
    const Nanoseconds used = options_.clock->now() - start;
    if (max_duration != Nanoseconds::zero() && used >= max_duration) return;
    child->executor.spin_some(max_duration == Nanoseconds::zero() ? max_duration
                                                                  : max_duration - used);
  }
}

void IsolatedExecutor::spin_all(Nanoseconds max_duration) {
  const Spin spin(*this);
  const TimePoint start = options_.clock->now();
  while (!cancelled_.load() && run_one()) {
    if (max_duration != Nanoseconds::zero() && options_.clock->now() - start >= max_duration)
      return;
  }
}

FutureReturnCode IsolatedExecutor::spin_until_complete(FutureState& future, Nanoseconds timeout) {
  const Spin spin(*this);
  const TimePoint limit = timeout < Nanoseconds::zero() ? kNever : options_.clock->now() + timeout;
  future.watch(this);
  run_on_caller(limit, [&] { return future.ready(); });
  future.watch(nullptr);
  if (future.ready()) return FutureReturnCode::SUCCESS;
  return cancelled_.load() ? FutureReturnCode::INTERRUPTED : FutureReturnCode::TIMEOUT;
}

// ---- Observing ----

void IsolatedExecutor::release_timers(bool released) noexcept {
  for (const auto& child : children()) child->executor.release_timers(released);
}

std::size_t IsolatedExecutor::pending() const noexcept {
  std::size_t count = 0;
  for (const auto& child : children()) count += child->executor.pending();
  return count;
}

std::vector<CallbackStatistics> IsolatedExecutor::statistics() const {
  std::vector<CallbackStatistics> result;
  for (const auto& child : children()) {
    for (auto& callback : child->executor.statistics()) result.push_back(std::move(callback));
  }
  return result;
}

std::vector<ThreadStatistics> IsolatedExecutor::thread_statistics() const {
  std::vector<ThreadStatistics> result;
  for (const auto& child : children()) {
    for (auto& thread : child->executor.thread_statistics()) result.push_back(std::move(thread));
  }
  return result;
}

TAKT_REGISTER_EXECUTOR("isolated", "one single-threaded executor and thread for each node",
                       IsolatedExecutor)

}  // namespace takt
