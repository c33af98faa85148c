// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/isolated_executor.hpp"

#include <algorithm>

#include <poll.h>

namespace takt {

/// Between begin and end of a spin, of whatever kind, this is the only one.
class IsolatedExecutor::Spin {
 public:
  /// `handler`: of those that run on threads of their own; nullptr: they run on the caller.
  explicit Spin(IsolatedExecutor& executor, const ExceptionHandler* handler = nullptr)
      : executor_(executor) {
    const std::lock_guard lock(executor_.mutex_);
    if (executor_.spinning_.exchange(true)) {
      throw Error("executor '" + executor_.options_.name + "' is spinning already");
    }
    executor_.runs_children_ = handler != nullptr;
    if (handler != nullptr) executor_.handler_ = *handler;
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
    : options_(options), backend_(make_wait_backend(kAutoWait, *options.clock, 1, true)) {
  for (const ThreadAttributes& thread : options.threads) thread.check();
  make_wait_backend(options.wait, *options.clock, 1, false);  // or the children would throw
  if (!options.scheduler.empty()) schedulers().check(options.scheduler);
}

// ---- Children ----

std::shared_ptr<IsolatedExecutor::Child> IsolatedExecutor::find(const Node& node,
                                                                const CallbackGroup* group) const {
  const std::lock_guard lock(mutex_);
  return find_child(node, group);
}

// With the mutex held.
std::shared_ptr<IsolatedExecutor::Child> IsolatedExecutor::find_child(
    const Node& node, const CallbackGroup* group) const {
  const auto child = std::find_if(children_.begin(), children_.end(), [&](const auto& candidate) {
    return candidate->node.lock().get() == &node && candidate->group.lock().get() == group;
  });
  return child == children_.end() ? nullptr : *child;
}

// What the group asks for of its thread.
static void take_over(const CallbackParameters& parameters, ThreadAttributes& thread) {
  if (thread.policy == ThreadPolicy::fifo || thread.policy == ThreadPolicy::rr) {
    thread.priority = parameters.priority.value_or(thread.priority);
  } else if (thread.policy == ThreadPolicy::deadline) {
    thread.runtime = parameters.budget.value_or(thread.runtime);
    thread.deadline = parameters.deadline.value_or(thread.deadline);
    thread.period = parameters.period.value_or(thread.period);
  }
}

// To the child of the node or, if there is one, the group; it is made when there is none, and stays
// only when it got something.
template <class Add>
void IsolatedExecutor::add(const std::shared_ptr<Node>& node,
                           const std::shared_ptr<CallbackGroup>& group, Add&& to_child) {
  std::shared_ptr<Child> child;
  {
    const std::lock_guard lock(mutex_);
    child = find_child(*node, group.get());
    if (child != nullptr) ++child->adding;
  }
  if (child != nullptr) {
    const auto end = [this](Child* to) {
      const std::lock_guard lock(mutex_);
      --to->adding;
      ++to->added;
    };
    const std::unique_ptr<Child, decltype(end)> adding(child.get(), end);
    to_child(child->executor);
    start(*child);
  } else {
    const std::lock_guard lock(mutex_);
    ExecutorOptions options = options_;
    options.name = node->name();
    options.per = Isolation::node;
    options.threads.clear();
    ThreadAttributes thread;
    if (!options_.threads.empty()) {
      thread = options_.threads[children_.size() % options_.threads.size()];
    }
    if (group != nullptr) {
      if (group != node->default_callback_group()) options.name += "/" + group->name();
      take_over(group->parameters(), thread);
    }
    thread.name = options.name;
    options.threads.push_back(thread);
    child = std::make_shared<Child>(*this, options, node, group);
    child->executor.release_timers(releases_timers_);
    to_child(child->executor);
    children_.push_back(child);
  }
  start(*child);
  wake();
}

std::vector<std::shared_ptr<IsolatedExecutor::Child>> IsolatedExecutor::children() const {
  const std::lock_guard lock(mutex_);
  return children_;
}

IsolatedExecutor::~IsolatedExecutor() {
  for (const auto& weak : nodes_) {
    const auto node = weak.lock();
    if (node == nullptr || !node->belongs_to(this)) continue;
    node->remove_listener(*this);
    node->release(this);
  }
}

void IsolatedExecutor::add_node(const std::shared_ptr<Node>& node) {
  if (!is_per_group()) {
    return add(node, nullptr, [&](Executor& executor) { executor.add_node(node); });
  }
  if (!node->claim(this)) {
    throw Error("node '" + node->fully_qualified_name() + "' belongs to an executor already",
                "remove it there first");
  }
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(nodes_, [](const auto& known) { return known.expired(); });
    nodes_.push_back(node);
  }
  node->add_listener(*this);
  try {
    for (const auto& entity : node->entities()) entity_added(*node, entity);
  } catch (...) {
    remove_node(node);
    throw;
  }
}

// The first callback of a group brings the group, and its thread.
void IsolatedExecutor::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  const std::shared_ptr<CallbackGroup>& group = entity->group();
  if (!group->automatically_add_to_executor() || !group->belongs_to(nullptr)) return;
  const std::shared_ptr<Node> shared = node.shared_from_this();
  try {
    add(shared, group, [&](Executor& executor) { executor.add_callback_group(group, shared); });
  } catch (const Error&) {
    if (group->belongs_to(nullptr)) throw;
    // Another thread has brought the group at the same time, and this callback with it.
  }
}

void IsolatedExecutor::add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                          const std::shared_ptr<Node>& node) {
  add(node, is_per_group() ? group : nullptr,
      [&](Executor& executor) { executor.add_callback_group(group, node); });
}

void IsolatedExecutor::refuse_stranger(const Node& node) const {
  throw Error("node '" + node.fully_qualified_name() + "' does not belong to executor '" +
              options_.name + "'");
}

void IsolatedExecutor::remove_node(const std::shared_ptr<Node>& node) {
  if (!is_per_group()) {
    const std::shared_ptr<Child> child = find(*node, nullptr);
    if (child == nullptr) refuse_stranger(*node);
    const std::uint64_t before = added(*child);
    child->executor.remove_node(node);
    return remove(child, before);
  }
  if (!node->belongs_to(this)) refuse_stranger(*node);
  node->remove_listener(*this);
  for (const auto& child : children()) {
    const auto group = child->group.lock();
    if (child->node.lock() != node) continue;
    const std::uint64_t before = added(*child);
    if (group != nullptr) child->executor.release_groups({group}, *node);
    remove(child, before);
  }
  node->release(this);
}

// To the one of the same name, if it was there before.
static void add_thread(std::vector<ThreadStatistics>& threads, const ThreadStatistics& thread) {
  const auto known = std::find_if(threads.begin(), threads.end(), [&](const auto& candidate) {
    return candidate.asked.name == thread.asked.name;
  });
  if (known == threads.end()) {
    threads.push_back(thread);
  } else {
    add_to(*known, thread);
  }
}

std::uint64_t IsolatedExecutor::added(const Child& child) const noexcept {
  const std::lock_guard lock(mutex_);
  return child.added;
}

// It has nothing to run any more, unless somebody has added something since `added_before` was
// read. In its own callback, on its thread or the caller's, it has not ended; it then ends with the
// executor.
void IsolatedExecutor::remove(const std::shared_ptr<Child>& child,
                              std::uint64_t added_before) noexcept {
  if (child->runs_on.load() == std::this_thread::get_id()) return;
  const auto is_used = [&] { return child->adding != 0 || child->added != added_before; };
  {
    const std::lock_guard lock(mutex_);
    if (is_used()) return;
  }
  const std::lock_guard joining(child->joining);  // until it is gone: nobody starts it again
  join(*child);
  const std::lock_guard lock(mutex_);
  const auto known = std::find(children_.begin(), children_.end(), child);
  if (known == children_.end()) return;  // somebody else has removed it too
  if (is_used()) return run_in_thread(*child);
  try {
    for (const auto& thread : child->executor.thread_statistics()) {
      add_thread(past_threads_, thread);
    }
    if (past_threads_.size() > PastStatistics::kMost) past_threads_.pop_back();
    for (auto& gone : child->executor.statistics()) past_.add(std::move(gone));
    children_.erase(known);
    child->is_gone = true;
  } catch (const Error&) {  // it is in a callback
  }
}

void IsolatedExecutor::remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                             const std::shared_ptr<Node>& node) {
  const std::shared_ptr<Child> child = find(*node, is_per_group() ? group.get() : nullptr);
  if (child == nullptr) refuse_stranger(*node);
  const std::uint64_t before = added(*child);
  child->executor.remove_callback_group(group, node);
  if (is_per_group()) remove(child, before);
}

// Starts the child's thread, if children have threads now and this one has none yet.
void IsolatedExecutor::start(Child& child) {
  if (child.runs_on.load() == std::this_thread::get_id()) return;  // who joins it may wait for us
  const std::lock_guard joining(child.joining);
  const std::lock_guard lock(mutex_);
  run_in_thread(child);
}

// With both mutexes held.
void IsolatedExecutor::run_in_thread(Child& child) {
  if (!runs_children_ || child.is_gone || child.thread.joinable()) return;
  child.thread = std::thread([this, &child, handler = handler_] {
    child.runs_on.store(std::this_thread::get_id());
    try {
      child.executor.spin(handler);
    } catch (...) {
      {
        const std::lock_guard exception_lock(mutex_);
        if (exception_ == nullptr) exception_ = std::current_exception();
      }
      cancel();
    }
    child.runs_on.store({});
  });
}

// Whoever comes second waits for the same end.
void IsolatedExecutor::stop(Child& child) noexcept {
  const std::lock_guard joining(child.joining);
  join(child);
}

// With `joining` held.
void IsolatedExecutor::join(Child& child) noexcept {
  if (child.thread.joinable()) {
    child.executor.cancel();
    child.thread.join();
  }
  child.executor.forget_cancel();  // the end of spin may have cancelled it meanwhile
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
  const Spin spin(*this, &handler);
  if (!cancelled_.load()) {
    for (const auto& child : children()) start(*child);
  }
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
    if (child->runs_on.load() != std::thread::id()) child->executor.cancel();
  }
  backend_->leave(0);
  for (const auto& child : children()) stop(*child);
  const std::lock_guard lock(mutex_);
  if (exception_ != nullptr) std::rethrow_exception(std::exchange(exception_, nullptr));
}

// It is the turn of the child after the one that has run last, so that none has to wait for ever.
bool IsolatedExecutor::run_one() {
  const auto all = children();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t turn = (next_turn_ + i) % all.size();
    if (!all[turn]->executor.run_one()) continue;
    next_turn_ = turn + 1;
    return true;
  }
  return false;
}

/// Runs the children in turn on the calling thread until done() or the limit, or one callback; done
/// is asked before every callback, and each time something wakes us.
template <class Done>
void IsolatedExecutor::run_on_caller(TimePoint limit, bool once, Done&& done) {
  for (const auto& child : children()) child->executor.set_observer(this);
  const auto stop_observing = [this](void*) {
    for (const auto& child : children()) {
      child->executor.set_observer(nullptr);
      backend_->unwatch(&child->waker);
    }
    wait_for_readers();
  };
  const std::unique_ptr<void, decltype(stop_observing)> guard(this, stop_observing);
  while (!cancelled_.load() && !done()) {
    has_news_.store(false);
    if (run_one()) {
      if (once || (limit != kNever && options_.clock->now() >= limit)) return;
      continue;
    }
    TimePoint deadline = limit;
    for (const auto& child : children()) {
      child->executor.set_observer(this);  // it may be new
      if (const int fd = child->executor.wait_fd(); fd >= 0) {
        backend_->watch({.fd = fd, .events = POLLIN, .listener = &child->waker});
      }
      deadline = std::min(deadline, child->executor.next_release());
    }
    if (cancelled_.load() || done()) return;
    if (!backend_->wait(0, deadline) && options_.clock->now() >= limit) return;
  }
}

void IsolatedExecutor::spin_once(Nanoseconds timeout) {
  const Spin spin(*this);
  const TimePoint limit = end_of(timeout, options_.clock->now());
  run_on_caller(limit, /*once=*/true, [] { return false; });
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
  const TimePoint limit = end_of(timeout, options_.clock->now());
  future.watch(this);
  run_on_caller(limit, /*once=*/false, [&] { return future.ready(); });
  future.watch(nullptr);
  if (future.ready()) return FutureReturnCode::SUCCESS;
  return cancelled_.load() ? FutureReturnCode::INTERRUPTED : FutureReturnCode::TIMEOUT;
}

// ---- Observing ----

bool IsolatedExecutor::is_spinning() const noexcept {
  const std::lock_guard lock(mutex_);
  return spinning_.load() &&
         (!runs_children_ || std::all_of(children_.begin(), children_.end(), [](const auto& child) {
           return child->executor.is_spinning();
         }));
}

void IsolatedExecutor::release_timers(bool released) noexcept {
  const std::lock_guard lock(mutex_);
  releases_timers_ = released;
  for (const auto& child : children_) child->executor.release_timers(released);
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
  const std::lock_guard lock(mutex_);
  return past_.with(std::move(result));
}

std::vector<ThreadStatistics> IsolatedExecutor::thread_statistics() const {
  std::vector<ThreadStatistics> result;
  for (const auto& child : children()) {
    for (auto& thread : child->executor.thread_statistics()) result.push_back(std::move(thread));
  }
  const std::lock_guard lock(mutex_);
  for (const ThreadStatistics& thread : past_threads_) add_thread(result, thread);
  return result;
}

TAKT_REGISTER_EXECUTOR("isolated", "a single-threaded executor and thread for each node or group",
                       IsolatedExecutor)

}  // namespace takt
