// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/isolated_executor.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/same_owner.hpp"
#include "takt/entities/wait_in_callback.hpp"
#include "takt/executors/spin_always.hpp"
#include "takt/executors/virtual_cpus.hpp"

namespace takt {
namespace {

void check_reentrant_threads(const ExecutorOptions& options) {
  const std::size_t threads = options.reentrant_threads;
  if (threads == 0 || threads > kMostReentrantThreads) {
    throw Error(
        fmt::format("executor '{}' has {} threads for each reentrant group", options.name, threads),
        fmt::format("give `reentrant_threads` 1 to {}", kMostReentrantThreads));
  }
  if (threads != 1 && options.per != Isolation::group) {
    throw Error(
        fmt::format("executor '{}' has a thread for each node, whatever its groups", options.name),
        "leave out `reentrant_threads`, or write `per: group`");
  }
}

// The threads of a child. The engine names all but the first one.
std::vector<ThreadAttributes> threads_for(const CallbackGroup* group, ThreadAttributes first,
                                          const ExecutorOptions& options) {
  std::vector<ThreadAttributes> threads{first};
  if (group == nullptr || group->type() != CallbackGroupType::Reentrant) return threads;
  first.name.clear();
  threads.resize(options.reentrant_threads, first);
  return threads;
}

}  // namespace

IsolatedExecutor::IsolatedExecutor(const ExecutorOptions& options, const ExecutorTraits& traits)
    : options_(options),
      traits_(traits),
      backend_(make_wait_backend(kAutoWait, *options.clock, 1, true)) {
  check_reentrant_threads(options);
  if (!has_virtual_cpus(*options.clock)) {
    for (const ThreadAttributes& thread : options.threads) thread.check();
    check_spin(options, options.threads);
  }
  // Throws here, not in a child.
  make_wait_backend(options.wait, *options.clock, options.reentrant_threads, false);
  if (!options.scheduler.empty()) schedulers().check(options.scheduler);
  sleeper_.begin();
}

// ---- Children ----

std::shared_ptr<IsolatedExecutor::Child> IsolatedExecutor::find(
    const std::shared_ptr<Node>& node, const std::shared_ptr<CallbackGroup>& group) const {
  const std::lock_guard lock(mutex_);
  return find_child(node, group);
}

// Called with the mutex held.
std::shared_ptr<IsolatedExecutor::Child> IsolatedExecutor::find_child(
    const std::shared_ptr<Node>& node, const std::shared_ptr<CallbackGroup>& group) const {
  const auto child = std::find_if(children_.begin(), children_.end(), [&](const auto& candidate) {
    return is_same_owner(candidate->node, node) && is_same_owner(candidate->group, group);
  });
  return child == children_.end() ? nullptr : *child;
}

void apply_parameters(const CallbackParameters& parameters, ThreadAttributes& thread) {
  if (thread.policy == ThreadPolicy::fifo || thread.policy == ThreadPolicy::rr) {
    thread.priority = parameters.priority.value_or(thread.priority);
  } else if (thread.policy == ThreadPolicy::deadline) {
    thread.runtime = parameters.budget.value_or(thread.runtime);
    thread.deadline = parameters.deadline.value_or(thread.deadline);
    thread.period = parameters.period.value_or(thread.period);
  }
}

// With the mutex held. The lowest free place, or the one with `after` free ones below it: a new
// child takes the thread of one that has gone.
IsolatedExecutor::ChildThread IsolatedExecutor::next_thread(std::size_t after,
                                                            const CallbackGroup* group) const {
  const auto is_taken = [&](std::size_t place) {
    return std::any_of(children_.begin(), children_.end(),
                       [&](const auto& child) { return child->place == place; });
  };
  std::size_t place = 0;
  for (;; ++place) {
    if (is_taken(place)) continue;
    if (after-- == 0) break;
  }
  const auto& all = options_.threads;
  ThreadAttributes thread = all.empty() ? ThreadAttributes{} : all[place % all.size()];
  if (group != nullptr) apply_parameters(group->parameters(), thread);
  return {place, std::move(thread)};
}

IsolatedExecutor::ChildThread IsolatedExecutor::thread_of(
    const std::shared_ptr<Node>& node, const std::shared_ptr<CallbackGroup>& group,
    std::size_t after) const {
  const std::shared_ptr<CallbackGroup> own = is_per_group() ? group : nullptr;
  const std::lock_guard lock(mutex_);
  const std::shared_ptr<Child> child = find_child(node, own);
  return child != nullptr ? ChildThread{child->place, child->attributes}
                          : next_thread(after, own.get());
}

// With the mutex held.
std::shared_ptr<IsolatedExecutor::Child> IsolatedExecutor::make_child(
    const std::shared_ptr<Node>& node, const std::shared_ptr<CallbackGroup>& group) {
  ExecutorOptions options = options_;
  options.name = node->name();
  options.per = Isolation::node;
  options.reentrant_threads = 1;
  auto [place, thread] = next_thread(0, group.get());
  if (group != nullptr && group != node->default_callback_group()) {
    options.name += "/" + group->name();
  }
  thread.name = options.name;
  options.threads = threads_for(group.get(), std::move(thread), options_);
  std::vector<ThreadAttributes> threads = options.threads;
  for (const auto& other : children_)
    threads.insert(threads.end(), other->executor.thread_count(), other->attributes);
  if (!has_virtual_cpus(*options.clock)) check_spin(options, threads);
  const auto child = std::make_shared<Child>(*this, options, node, group, place);
  child->executor.release_timers(releases_timers_);
  if (traced_events_ != 0) child->executor.begin_trace(traced_events_);
  children_.push_back(child);
  return child;
}

// Adds to the child of the node or, if there is one, of the group. Makes the child if there is
// none, and keeps it only if something was added.
template <class Add>
void IsolatedExecutor::add(const std::shared_ptr<Node>& node,
                           const std::shared_ptr<CallbackGroup>& group, Add&& to_child) {
  remove_forgotten();
  std::shared_ptr<Child> child;
  {
    const std::lock_guard lock(mutex_);
    child = find_child(node, group);
    if (child == nullptr) child = make_child(node, group);
    ++child->adding;
  }
  const auto end = [this, &child](void*) {
    {
      const std::lock_guard lock(mutex_);
      --child->adding;
    }
    remove_unless_used(child);
  };
  const std::unique_ptr<void, decltype(end)> adding(this, end);
  to_child(child->executor);
  {
    const std::lock_guard lock(mutex_);
    child->may_spin = true;
    start(*child);
  }
  wake();
}

std::vector<std::shared_ptr<IsolatedExecutor::Child>> IsolatedExecutor::children() const {
  const std::lock_guard lock(mutex_);
  return children_;
}

std::vector<std::shared_ptr<IsolatedExecutor::Child>> IsolatedExecutor::children_to_spin() const {
  std::vector<std::shared_ptr<Child>> result;
  const std::lock_guard lock(mutex_);
  std::copy_if(children_.begin(), children_.end(), std::back_inserter(result),
               [](const auto& child) { return child->may_spin; });
  return result;
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

// The first callback of a group adds the group, and starts its thread.
void IsolatedExecutor::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  const std::shared_ptr<CallbackGroup>& group = entity->group();
  if (!group->automatically_add_to_executor() || !group->belongs_to(nullptr)) return;
  const std::shared_ptr<Node> shared = node.shared_from_this();
  try {
    add(shared, group, [&](Executor& executor) { executor.add_callback_group(group, shared); });
  } catch (const Error&) {
    if (group->belongs_to(nullptr)) throw;
    // Another thread has added the group at the same time, and this callback with it.
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
    const std::shared_ptr<Child> child = find(node, nullptr);
    if (child == nullptr) refuse_stranger(*node);
    child->executor.remove_node(node);
    return remove_unless_used(child);
  }
  if (!node->belongs_to(this)) refuse_stranger(*node);
  node->remove_listener(*this);
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(nodes_, [&](const auto& known) { return is_same_owner(known, node); });
  }
  for (const auto& child : children()) {
    if (!is_same_owner(child->node, node)) continue;
    const auto group = child->group.lock();
    if (group != nullptr) child->executor.callbacks().release_groups({group}, *node);
    remove_unless_used(child);
  }
  node->release(this);
}

// Called with the mutex held. `node`: the child's own, if it exists.
bool IsolatedExecutor::is_used(Child& child, const Node* node) {
  return child.adding != 0 || child.executor.callbacks().is_used_by(node);
}

// Code of the user (a callback, say) does not wait for the end of the child's thread, which may be
// in a callback that waits for this one. So it only cancels that thread, and the thread that spins
// removes the child.
void IsolatedExecutor::remove_unless_used(const std::shared_ptr<Child>& child) {
  const std::shared_ptr<Node> node = child->node.lock();  // destroyed after the lock
  Lock lock(mutex_);
  if (child->is_gone || is_used(*child, node.get())) return;
  const bool has_thread = child->thread.joinable();
  if (!detail::WaitInCallback::may_be_awaited() || (!has_thread && !child->is_joined)) {
    return end(child, node.get(), lock);
  }
  child->may_go = true;
  if (has_thread) child->executor.cancel();
}

// Removes children whose node or group was dropped without having been removed.
void IsolatedExecutor::remove_forgotten() {
  for (const auto& child : children()) {
    if (child->node.expired() || (is_per_group() && child->group.expired())) {
      remove_unless_used(child);
    }
  }
}

// Ends the children that were removed inside a callback. It takes no pointer to other children or
// nodes, not even for a moment, because a thread that drops the last pointer to a node relies on
// the end of that node.
void IsolatedExecutor::finish_removals() {
  const auto may_end = [](const auto& child) { return child->may_go && !child->runs.load(); };
  std::vector<std::shared_ptr<Child>> removed;
  {
    const std::lock_guard lock(mutex_);
    std::copy_if(children_.begin(), children_.end(), std::back_inserter(removed), may_end);
  }
  for (const auto& child : removed) {
    const std::shared_ptr<Node> node = child->node.lock();  // destroyed after the lock
    Lock lock(mutex_);
    if (may_end(child)) end(child, node.get(), lock);
  }
}

// Called with the mutex held. Releases it while it waits for the child's thread, and when the child
// is gone: then the child's executor forgets the node.
void IsolatedExecutor::end(const std::shared_ptr<Child>& child, Node* node, Lock& lock) {
  join(*child, lock);
  if (child->is_gone) return;  // another thread has removed the child, too
  child->may_go = false;
  if (is_used(*child, node)) return start(*child);  // it is used again
  try {
    for (const auto& thread : child->executor.thread_statistics()) past_threads_.add(thread);
    if (past_traces_) {
      for (const auto& thread : child->executor.traces()) past_traces_->add(thread);
    }
    for (auto& gone : child->executor.statistics()) past_.add(std::move(gone));
    std::erase(children_, child);
    child->is_gone = true;
  } catch (const Error&) {  // the child is in a callback, on the thread that spins
    child->may_go = true;
    return;
  }
  lock.unlock();
  if (node != nullptr) child->executor.callbacks().forget(*node);
}

void IsolatedExecutor::remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                             const std::shared_ptr<Node>& node) {
  const std::shared_ptr<Child> child = find(node, is_per_group() ? group : nullptr);
  if (child == nullptr) refuse_stranger(*node);
  child->executor.remove_callback_group(group, node);
  remove_unless_used(child);
}

// Called with the mutex held. Starts the child's thread, if children have threads now and this one
// has none. While a thread joins the previous one, nothing is started: that thread calls `start`
// again.
void IsolatedExecutor::start(Child& child) {
  if (handler_ == nullptr || !child.may_spin || child.is_gone || child.is_joined ||
      child.thread.joinable())
    return;
  child.runs.store(true);
  try {
    child.thread = std::thread([this, &child, handler = handler_] { run(child, *handler); });
  } catch (...) {
    child.runs.store(false);
    throw;
  }
}

void IsolatedExecutor::run(Child& child, const ExceptionHandler& handler) noexcept {
  try {
    child.executor.spin(handler);
  } catch (...) {
    {
      const std::lock_guard lock(mutex_);
      if (exception_ == nullptr) exception_ = std::current_exception();
    }
    cancel();
  }
  child.runs.store(false);
  wake();
}

// Joins the child's thread. Called with the mutex held, which it releases meanwhile. A second
// caller waits for the same end.
void IsolatedExecutor::join(Child& child, Lock& lock) {
  while (child.is_joined.load()) {
    lock.unlock();
    child.is_joined.wait(true);
    lock.lock();
  }
  if (child.thread.joinable()) {
    child.is_joined.store(true);
    std::thread thread = std::move(child.thread);
    child.executor.cancel();
    lock.unlock();
    thread.join();
    lock.lock();
    child.is_joined.store(false);
    child.is_joined.notify_all();
  }
  child.executor.workers().take_stop();  // the end of spin may have cancelled it meanwhile
}

// ---- Observing ----

bool IsolatedExecutor::is_spinning() const noexcept {
  const std::lock_guard lock(mutex_);
  return spinning_.load() &&
         (handler_ == nullptr ||
          std::all_of(children_.begin(), children_.end(), [](const auto& child) {
            return child->may_go || child->executor.is_spinning();
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

// With the mutex held: a child that goes meanwhile would be counted twice, in past_ too.
std::vector<CallbackStatistics> IsolatedExecutor::statistics() const {
  std::vector<CallbackStatistics> result;
  const std::lock_guard lock(mutex_);
  for (const auto& child : children_) {
    for (auto& callback : child->executor.statistics()) result.push_back(std::move(callback));
  }
  return past_.with(std::move(result));
}

std::vector<ThreadStatistics> IsolatedExecutor::thread_statistics() const {
  std::vector<ThreadStatistics> result;
  for (const auto& child : children()) {
    for (auto& thread : child->executor.thread_statistics()) result.push_back(std::move(thread));
  }
  const std::lock_guard lock(mutex_);
  return past_threads_.with(std::move(result));
}

// While it spins: those of the children, and the caller's, which waits.
std::size_t IsolatedExecutor::thread_count() const {
  std::size_t count = 1;
  const std::lock_guard lock(mutex_);
  for (const auto& child : children_) {
    if (child->runs.load()) count += child->executor.thread_count();
  }
  return count;
}

std::vector<int> IsolatedExecutor::running_threads() const {
  std::vector<int> result;
  for (const auto& child : children()) {
    for (const int thread : child->executor.running_threads()) result.push_back(thread);
  }
  return result;
}

void IsolatedExecutor::begin_trace(std::size_t events) {
  detail::check_begin_trace(options_);
  const std::lock_guard lock(mutex_);
  for (const auto& child : children_) child->executor.begin_trace(events);
  past_traces_.emplace(events);
  traced_events_ = events;
}

void IsolatedExecutor::end_trace() noexcept {
  const std::lock_guard lock(mutex_);
  for (const auto& child : children_) child->executor.end_trace();
  traced_events_ = 0;
}

std::vector<ThreadStatistics> IsolatedExecutor::traces() const {
  std::vector<ThreadStatistics> result;
  const std::lock_guard lock(mutex_);
  for (const auto& child : children_) {
    for (auto& thread : child->executor.traces()) result.push_back(std::move(thread));
  }
  if (!past_traces_) return result;
  return past_traces_->with(std::move(result));
}

TAKT_REGISTER_EXECUTOR_CLASS("isolated",
                             "a single-threaded executor and thread for each node or group",
                             IsolatedExecutor, .max_threads = SIZE_MAX, .isolates = true,
                             .simulated = true)

}  // namespace takt
