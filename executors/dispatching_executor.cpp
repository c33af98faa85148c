// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/dispatching_executor.hpp"

#include <algorithm>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "takt/base/read_section.hpp"
#include "takt/base/sequence.hpp"
#include "takt/sched/memory_lock.hpp"
#include "takt/sched/realtime_thread.hpp"

namespace takt {
namespace {

// The executor whose worker the calling thread is: removing from it must not wait for ourselves.
[[gnu::tls_model("initial-exec")]] thread_local constinit const Executor* worker_of = nullptr;

std::vector<ThreadAttributes> threads_for(const ExecutorOptions& options,
                                          const ExecutorTraits& traits) {
  std::vector<ThreadAttributes> threads = options.threads;
  if (threads.empty()) {
    threads.resize(traits.pool ? std::max(2u, std::thread::hardware_concurrency()) : 1);
  }
  if (threads.size() > traits.max_threads) {
    throw Error(fmt::format("executor '{}' was given {} threads", options.name, threads.size()),
                fmt::format("this type takes {} at the most", traits.max_threads));
  }
  return threads;
}

std::uint32_t id_of(std::vector<std::pair<const void*, std::uint32_t>>& ids, const void* object) {
  const auto known = std::find_if(ids.begin(), ids.end(),
                                  [&](const auto& entry) { return entry.first == object; });
  if (known != ids.end()) return known->second;
  ids.emplace_back(object, static_cast<std::uint32_t>(ids.size()));
  return ids.back().second;
}

}  // namespace

struct DispatchingExecutor::Record final : CallbackRecord {
  explicit Record(DispatchingExecutor& owner) : executor(owner) {}
  DispatchingExecutor& executor;
  bool detached = false;  // guarded by control_mutex_: nobody announces any more

  void announce(const Arrival& arrival) noexcept override {
    if (worker_of == &executor && !executor.shared_) {
      executor.ready_.announce_from_callback(*this, arrival);
    } else if (executor.ready_.announce(*this, arrival)) {
      executor.wake();
    }
  }
  void release_changed() noexcept override {
    if (executor.ready_.announce_change(*this)) executor.wake();
  }
  void remove() noexcept override { executor.remove(*this); }
  void expect_remove() noexcept override { executor.expected_removals_.fetch_add(1); }
  bool wants_time() const noexcept override { return executor.reads_clock_; }
};

/// Between begin and end of a spin, of whatever kind, this is the only one.
class DispatchingExecutor::Spin {
 public:
  explicit Spin(DispatchingExecutor& executor) : executor_(executor) {
    const std::lock_guard lock(executor_.control_mutex_);
    if (executor_.spinning_.load()) {
      throw Error("executor '" + executor_.options_.name + "' is spinning already");
    }
    if (executor_.has_changes_) executor_.hand_plan_over();
    executor_.spinning_.store(true);
    executor_.was_spun_ = true;
    outer_ = std::exchange(worker_of, &executor_);
    const ReadSection registers_this_thread;
    executor_.install_plan();
    executor_.ready_.read_clock();
  }
  ~Spin() {
    executor_.backend_->leave(0);
    const std::lock_guard lock(executor_.control_mutex_);
    executor_.install_plan();
    worker_of = outer_;
    executor_.spinning_.store(false);
  }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

  /// True when a cancel has come, from before the spin or during it: it is used up now.
  bool take_cancel() noexcept { return executor_.cancelled_.exchange(false); }

 private:
  DispatchingExecutor& executor_;
  const Executor* outer_;
};

DispatchingExecutor::DispatchingExecutor(const ExecutorOptions& options,
                                         const ExecutorTraits& traits)
    : options_(options),
      traits_(traits),
      scheduler_(options.scheduler.empty() ? traits.scheduler : options.scheduler),
      threads_(threads_for(options, traits)),
      shared_(threads_.size() > 1),
      records_times_(options.statistics == StatisticsLevel::full),
      reads_clock_(records_times_ || options.clock->as_manual() != nullptr ||
                   schedulers().make(scheduler_)->uses_time()),
      backend_(make_wait_backend(*options.clock, threads_.size())),
      ready_(traits.readiness, *options.clock, reads_clock_),
      has_changes_(true) {  // the first plan brings the scheduler
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    ThreadAttributes& thread = threads_[i];
    if (thread.name.empty()) {
      thread.name = i == 0 ? options.name : fmt::format("{}-{}", options.name, i);
    }
    thread.check();
  }
}

DispatchingExecutor::~DispatchingExecutor() {
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      node->remove_listener(*this);
    }
  }
  std::vector<Record*> mine;
  {
    const std::lock_guard lock(control_mutex_);
    const std::lock_guard ownership(ownership_mutex());
    for (const auto& record : records_) {
      if (record->entity->owner() != record.get()) continue;  // its remover is on the way
      record->entity->set_owner(nullptr);
      expected_removals_.fetch_add(1);
      mine.push_back(record.get());
    }
  }
  for (Record* record : mine) remove(*record);
  for (std::size_t left; (left = expected_removals_.load()) != 0;) expected_removals_.wait(left);
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      for (const auto& group : node->groups()) group->release(static_cast<NodeListener*>(this));
      node->release(this);
    }
  }
  delete plan_.load();
  take_what_is_gone();
}

// ---- Adding and removing: control threads ----

void DispatchingExecutor::refuse_when_frozen(const char* what) const {
  const std::lock_guard lock(control_mutex_);
  if (traits_.frozen && was_spun_) {
    throw Error(fmt::format("executor '{}' is static: nothing can be {} after its first spin",
                            options_.name, what),
                "do it before, or choose 'single_threaded'");
  }
}

void DispatchingExecutor::add_node(const std::shared_ptr<Node>& node) {
  refuse_when_frozen("added");
  if (!node->claim(this)) {
    throw Error("node '" + node->fully_qualified_name() + "' belongs to an executor already",
                "remove it there first");
  }
  remember(node);
  node->add_listener(*this);
  for (const auto& group : node->groups()) {
    if (group->automatically_add_to_executor() && group->claim(static_cast<NodeListener*>(this))) {
      add_group(group, *node);
    }
  }
}

void DispatchingExecutor::add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                             const std::shared_ptr<Node>& node) {
  refuse_when_frozen("added");
  const auto groups = node->groups();
  if (std::find(groups.begin(), groups.end(), group) == groups.end()) {
    throw Error(fmt::format("callback group '{}' is not one of node '{}'", group->name(),
                            node->fully_qualified_name()));
  }
  if (!group->claim(static_cast<NodeListener*>(this))) {
    throw Error(fmt::format("callback group '{}' of node '{}' belongs to an executor already",
                            group->name(), node->fully_qualified_name()),
                "remove it there first");
  }
  remember(node);
  node->add_listener(*this);
  add_group(group, *node);
}

void DispatchingExecutor::remember(const std::shared_ptr<Node>& node) {
  const std::lock_guard lock(control_mutex_);
  std::erase_if(nodes_, [](const auto& known) { return known.expired(); });
  nodes_.push_back(node);
}

void DispatchingExecutor::add_group(const std::shared_ptr<CallbackGroup>& group, Node& node) {
  for (const auto& entity : node.entities()) {
    if (entity->group() == group) add_entity(entity, node);
  }
}

void DispatchingExecutor::group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) {
  if (node.belongs_to(this) && group->automatically_add_to_executor()) {
    group->claim(static_cast<NodeListener*>(this));
  }
}

void DispatchingExecutor::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  if (!entity->group()->belongs_to(static_cast<NodeListener*>(this))) return;
  refuse_when_frozen("added");
  add_entity(entity, node);
}

void DispatchingExecutor::add_entity(const std::shared_ptr<Entity>& entity, const Node& node) {
  std::vector<std::unique_ptr<Record>> gone;
  const std::lock_guard lock(control_mutex_);
  gone = take_what_is_gone();
  auto record = std::make_unique<Record>(*this);
  record->entity = entity;
  record->group = entity->group();
  record->node = node.fully_qualified_name();
  const CallbackParameters& parameters = record->group->parameters();
  record->description = {.id = next_callback_id_,
                         .kind = entity->kind(),
                         .registration = next_callback_id_,
                         .group = id_of(group_ids_, record->group.get()),
                         .node = id_of(node_ids_, &node),
                         .priority = parameters.priority,
                         .period = entity->period(),
                         .deadline = parameters.deadline};
  ++next_callback_id_;
  record->info = &record->description;
  {
    const std::lock_guard ownership(ownership_mutex());
    if (entity->owner() != nullptr) return;  // seen twice: in the node's list, and as news
    entity->set_owner(record.get());
  }
  changes_.added.push_back(record.get());
  records_.push_back(std::move(record));
  has_changes_ = true;
  if (spinning_.load()) hand_plan_over();
}

void DispatchingExecutor::remove_node(const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!node->belongs_to(this)) {
    throw Error("node '" + node->fully_qualified_name() + "' does not belong to executor '" +
                options_.name + "'");
  }
  node->remove_listener(*this);
  for (const auto& group : node->groups()) {
    if (group->belongs_to(static_cast<NodeListener*>(this))) release_group(*group, *node);
  }
  node->release(this);
}

void DispatchingExecutor::remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                                const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!group->belongs_to(static_cast<NodeListener*>(this))) {
    throw Error(fmt::format("callback group '{}' of node '{}' does not belong to executor '{}'",
                            group->name(), node->fully_qualified_name(), options_.name));
  }
  release_group(*group, *node);
}

void DispatchingExecutor::release_group(CallbackGroup& group, const Node& node) noexcept {
  for (const auto& entity : node.entities()) {
    if (entity->group().get() == &group) entity->Entity::retire();
  }
  group.release(static_cast<NodeListener*>(this));
}

// 1. The record leaves the list, so that the next plan does not know it.
// 2. A dispatch point installs that plan: from then on the record is skipped wherever it stands.
// 3. The running callback ends; then nobody executes the entity any more.
// 4. The entity forgets its sink; when all read sections have ended, nobody announces any more.
// 5. The record is freed when it has come out of inbox and scheduler.
void DispatchingExecutor::remove(Record& record) noexcept {
  {
    const std::lock_guard lock(control_mutex_);
    const auto entry = std::find_if(records_.begin(), records_.end(),
                                    [&](const auto& known) { return known.get() == &record; });
    removed_records_.push_back(std::move(*entry));
    records_.erase(entry);
    changes_.removed.push_back(&record);
    hand_plan_over();
    if (!spinning_.load()) install_plan();
  }
  if (worker_of == this) {
    lock();
    install_plan();
    unlock();
  }
  const Dispatch* dispatch = Dispatch::current();
  if (dispatch == nullptr || dispatch->callback != &record.description) record.gone.wait(0);
  record.entity->detach();
  std::vector<std::unique_ptr<Record>> gone;
  {
    const std::lock_guard lock(control_mutex_);
    record.detached = true;
    gone = take_what_is_gone();
  }
  gone.clear();
  if (expected_removals_.fetch_sub(1) == 1) expected_removals_.notify_all();
}

// With control_mutex_ held. What an earlier plan, not yet installed, would have changed is taken
// along.
void DispatchingExecutor::hand_plan_over() {
  auto plan = std::make_unique<ReadyPlan>();
  plan->added = std::exchange(changes_.added, {});
  plan->removed = std::exchange(changes_.removed, {});
  if (const std::unique_ptr<ReadyPlan> earlier{plan_.exchange(nullptr)}) {
    plan->added.insert(plan->added.begin(), earlier->added.begin(), earlier->added.end());
    plan->removed.insert(plan->removed.begin(), earlier->removed.begin(), earlier->removed.end());
  }
  std::vector<CallbackInfo> infos;
  std::vector<std::pair<CallbackGroup*, std::vector<CallbackInfo>>> groups;
  const auto members_of = [&groups](const CallbackRecord& record) -> std::vector<CallbackInfo>& {
    CallbackGroup* group = record.group.get();
    for (auto& known : groups) {
      if (known.first == group) return known.second;
    }
    return groups.emplace_back(group, std::vector<CallbackInfo>{}).second;
  };
  // A group whose last callback goes gets an empty parking place instead of the one with its
  // records.
  for (const CallbackRecord* record : plan->removed) members_of(*record);
  for (const auto& record : records_) {
    infos.push_back(record->description);
    members_of(*record).push_back(record->description);
  }
  plan->scheduler = schedulers().make(scheduler_);
  plan->scheduler->configure(infos);
  for (const auto& [group, members] : groups) {
    plan->parking.emplace_back(group, schedulers().make(scheduler_));
    plan->parking.back().second->configure(members);
  }
  plan->timers.reserve(infos.size());
  has_changes_ = false;
  plan_.store(plan.release());
  wake();
}

// Serialised with dispatch: by a worker under the lock, or while nobody spins.
void DispatchingExecutor::install_plan() noexcept {
  if (plan_.load(std::memory_order_relaxed) == nullptr) return;
  if (ReadyPlan* plan = plan_.exchange(nullptr)) {
    ready_.install(*plan);
    used_plans_.push(*plan);
  }
}

// With control_mutex_ held; the caller destroys them after it is released, because what a user's
// callback holds goes with them, and may be another entity of ours.
std::vector<std::unique_ptr<DispatchingExecutor::Record>>
DispatchingExecutor::take_what_is_gone() noexcept {
  for (ReadyPlan* plan = used_plans_.take_all(); plan != nullptr;) {
    const std::unique_ptr<ReadyPlan> used(plan);
    plan = plan->inbox_next;
  }
  std::vector<std::unique_ptr<Record>> gone;
  for (auto& record : removed_records_) {
    if (record->gone.load() == 1 && record->detached && !record->queued.load() &&
        !record->held.load() && !record->changed.load()) {
      gone.push_back(std::move(record));
    }
  }
  std::erase(removed_records_, nullptr);
  return gone;
}

// ---- Sleeping and waking ----

bool DispatchingExecutor::claim_idle() noexcept {
  std::size_t idle = idle_.load();
  while (idle != 0) {
    if (idle_.compare_exchange_weak(idle, idle - 1)) return true;
  }
  return false;
}

// Wakes one sleeping worker. Whoever announces has written its news before, and a worker counts
// itself idle before it looks for news a last time, both sequentially consistent: no wake-up is
// lost, and without sleepers it costs one load.
void DispatchingExecutor::wake() noexcept {
  if (claim_idle()) {
    backend_->post();
  } else if (Wakeable* observer = observer_.load()) {
    observer->wake();
  }
}

void DispatchingExecutor::wake_all() noexcept {
  while (claim_idle()) backend_->post();
}

// With the lock held, after `next` found nothing. True: look again; false: the limit has come.
bool DispatchingExecutor::sleep(std::size_t index, TimePoint limit,
                                const FutureState* future) noexcept {
  TimePoint deadline = limit;
  const TimePoint release = ready_.next_release();
  if (timekeeper_ == kNobody || release < timekeeper_deadline_) {
    timekeeper_ = index;
    timekeeper_deadline_ = release;
    deadline = std::min(deadline, release);
  }
  idle_.fetch_add(1);
  const bool has_news = ready_.has_news() || plan_.load() != nullptr || stopping() ||
                        (future != nullptr && future->ready());
  unlock();
  const bool was_woken = !has_news && backend_->wait(index, deadline);
  // We are still counted as idle, unless somebody is about to wake us: then we take the post.
  if (!was_woken && !claim_idle()) backend_->wait(index, kNever);
  lock();
  if (timekeeper_ == index) timekeeper_ = kNobody;
  ready_.read_clock();
  return ready_.now() < limit || has_news;
}

// With the lock held, when a worker is about to execute: if there is more to do than it can, or
// nobody left who keeps time, another is woken.
void DispatchingExecutor::pass_on() noexcept {
  if (!shared_ || idle_.load() == 0) return;
  const TimePoint release = ready_.next_release();
  const bool needs_timekeeper =
      release != kNever && (timekeeper_ == kNobody || release < timekeeper_deadline_);
  if (ready_.waiting() != 0 || ready_.has_news() || needs_timekeeper) wake();
}

void DispatchingExecutor::cancel() noexcept {
  cancelled_.store(true);
  wake_all();
}

// ---- Dispatch ----

// With the lock held, before and after.
[[gnu::flatten]] bool DispatchingExecutor::run_next(const ReadySet::Limits& limits) noexcept {
  install_plan();
  CallbackRecord* record = ready_.next(limits);
  if (record == nullptr) return false;
  pass_on();
  unlock();
  execute(*record);  // ends with the lock held
  return true;
}

void DispatchingExecutor::execute(CallbackRecord& record) noexcept {
  // In a reentrant group the record may be announced, and picked, again while we execute.
  const ReadyCallback* callback = &record;
  ReadyCallback as_picked;
  Slot slot;
  slot.sequence = record.sequence;
  const bool taken = record.entity->take(slot);
  if (record.is_reentrant()) {
    as_picked = record;
    callback = &as_picked;
    lock();
    ready_.taken(record, slot.more);
    pass_on();
    unlock();
  }
  // Between the end of one callback and the start of the next lie some 50 ns of ours when there
  // is one worker: one reading of the clock serves both.
  const TimePoint start = !reads_clock_ ? TimePoint{}
                          : shared_     ? options_.clock->now()
                                        : ready_.now();
  if (taken) {
    const bool is_root = slot.chain_instance == 0;
    const Dispatch dispatch{&record.description, is_root ? slot.sequence : slot.chain_instance,
                            is_root ? slot.ready_time : slot.root_release};
    const Dispatch::Scope scope(dispatch);
    try {
      record.entity->execute(slot);
    } catch (...) {
      caught(std::current_exception());
    }
  }
  lock();
  if (reads_clock_) ready_.read_clock();
  if (taken && options_.statistics != StatisticsLevel::off) record_run(record, slot, start);
  ready_.finished(record, *callback, slot.more,
                  reads_clock_ ? ready_.now() - start : Nanoseconds::zero());
}

// A callback has thrown: the user's handler gets it, or spin ends with it.
void DispatchingExecutor::caught(std::exception_ptr exception) noexcept {
  if (handler_) return handler_(exception);
  lock();
  if (exception_ == nullptr) exception_ = exception;
  unlock();
  wake_all();
}

// The classes late and too late are those of irobot-ros/ros2-performance: of the message's period
// T, late is more than min(20 % T, 5 ms), too late more than min(T, 50 ms).
void DispatchingExecutor::record_run(CallbackRecord& record, const Slot& slot,
                                     TimePoint start) noexcept {
  CallbackStatistics& statistics = record.statistics;
  ++statistics.received;
  if (!records_times_) return;
  const TimePoint end = ready_.now();
  statistics.execution.record(end - start);
  if (slot.ready_time == TimePoint{}) return;  // sent before anybody wanted its time
  const Nanoseconds latency = start - slot.ready_time;
  statistics.latency.record(latency);
  const Nanoseconds deadline = record.description.deadline;
  if (deadline != Nanoseconds::zero() && end - slot.ready_time > deadline) {
    ++statistics.deadline_misses;
  }
  const Nanoseconds period = slot.expected_period;
  if (period == Nanoseconds::zero() || record.is_timer()) return;
  if (latency > std::min<Nanoseconds>(period, std::chrono::milliseconds(50))) {
    ++statistics.too_late;
  } else if (latency > std::min<Nanoseconds>(period / 5, std::chrono::milliseconds(5))) {
    ++statistics.late;
  }
}

// ---- Spinning ----

void DispatchingExecutor::rethrow() {
  if (exception_ != nullptr) std::rethrow_exception(std::exchange(exception_, nullptr));
}

void DispatchingExecutor::start_worker(std::size_t index) {
  thread_statistics_[index].asked = threads_[index];
  thread_statistics_[index].in_force = index == 0 && options_.threads.empty()
                                           ? this_thread_state()
                                           : apply(threads_[index], options_.realtime);
  prefault_stack();
}

void DispatchingExecutor::spin(const ExceptionHandler& handler) {
  Spin spin(*this);
  if (spin.take_cancel()) return;
  handler_ = handler;
  thread_statistics_.assign(threads_.size(), {});
  const auto loop = [this](std::size_t index) {
    worker_of = this;
    { const ReadSection registers_this_thread; }
    backend_->enter(index);
    const RealtimeScope scope;
    const Nanoseconds cpu_time = thread_cpu_time();
    const TimePoint start = Clock::steady().now();
    lock();
    while (!stopping()) {
      if (!run_next({})) sleep(index, kNever);
    }
    unlock();
    ThreadStatistics& statistics = thread_statistics_[index];
    statistics.counters = scope.so_far();
    statistics.cpu_time = thread_cpu_time() - cpu_time;
    statistics.wall_time = Clock::steady().now() - start;
    backend_->leave(index);
  };
  {
    std::vector<std::unique_ptr<RealtimeThread>> pool;
    try {
      for (std::size_t i = 1; i < threads_.size(); ++i) {
        pool.push_back(std::make_unique<RealtimeThread>(threads_[i], options_.realtime,
                                                        [&loop, i] { loop(i); }));
        thread_statistics_[i].asked = threads_[i];
        thread_statistics_[i].in_force = pool.back()->state();
      }
      start_worker(0);
    } catch (...) {
      cancel();
      pool.clear();
      spin.take_cancel();
      throw;
    }
    loop(0);
    wake_all();
  }
  handler_ = nullptr;
  spin.take_cancel();
  rethrow();
}

void DispatchingExecutor::spin_once(Nanoseconds timeout) {
  Spin spin(*this);
  const TimePoint limit = timeout < Nanoseconds::zero() ? kNever : options_.clock->now() + timeout;
  lock();
  while (!stopping() && !run_next({}) && sleep(0, limit)) {
  }
  unlock();
  spin.take_cancel();
  rethrow();
}

bool DispatchingExecutor::run_one() {
  Spin spin(*this);
  lock();
  const bool has_run = run_next({});
  unlock();
  rethrow();
  return has_run;
}

void DispatchingExecutor::spin_some(Nanoseconds max_duration) {
  Spin spin(*this);
  if (spin.take_cancel()) return;
  const TimePoint start = ready_.now();
  lock();
  // A snapshot that spin_once has left unfinished is finished instead of taking another.
  if (!ready_.is_wait_set() || ready_.waiting() == 0) ready_.poll();
  const ReadySet::Limits limits{
      .last_sequence = ready_.is_wait_set() ? UINT64_MAX : next_sequence(), .may_poll = false};
  while (!stopping() && run_next(limits)) {
    if (max_duration == Nanoseconds::zero()) continue;
    ready_.read_clock();
    if (ready_.now() - start >= max_duration) break;
  }
  ready_.restore_deferred();
  unlock();
  spin.take_cancel();
  rethrow();
}

void DispatchingExecutor::spin_all(Nanoseconds max_duration) {
  Spin spin(*this);
  if (spin.take_cancel()) return;
  const TimePoint start = ready_.now();
  lock();
  while (!stopping() && run_next({})) {
    if (max_duration == Nanoseconds::zero()) continue;
    ready_.read_clock();
    if (ready_.now() - start >= max_duration) break;
  }
  unlock();
  spin.take_cancel();
  rethrow();
}

FutureReturnCode DispatchingExecutor::spin_until_complete(FutureState& future,
                                                          Nanoseconds timeout) {
  Spin spin(*this);
  const TimePoint limit = timeout < Nanoseconds::zero() ? kNever : options_.clock->now() + timeout;
  future.watch(this);
  lock();
  while (!stopping() && !future.ready() &&
         (run_next({}) ? ready_.now() < limit : sleep(0, limit, &future))) {
  }
  unlock();
  future.watch(nullptr);
  const bool was_cancelled = spin.take_cancel();
  rethrow();
  if (future.ready()) return FutureReturnCode::SUCCESS;
  return was_cancelled ? FutureReturnCode::INTERRUPTED : FutureReturnCode::TIMEOUT;
}

// ---- Observing ----

std::size_t DispatchingExecutor::pending() const noexcept {
  const std::lock_guard lock(control_mutex_);
  std::size_t count = 0;
  for (const auto& record : records_) {
    // In this order: who sees that a message was taken sees that its callback executes.
    if ((!record->is_timer() && record->entity->ready_count() != 0) ||
        record->executing.load() != 0 || record->held.load() || record->queued.load()) {
      ++count;
    }
  }
  return count;
}

std::vector<CallbackStatistics> DispatchingExecutor::statistics() const {
  const std::lock_guard lock(control_mutex_);
  if (spinning_.load()) {
    throw Error("executor '" + options_.name + "' is spinning", "read its statistics afterwards");
  }
  std::vector<CallbackStatistics> result;
  for (const auto& record : records_) {
    CallbackStatistics statistics = record->statistics;
    const Entity::Report report = record->entity->report();
    statistics.node = record->node;
    statistics.group = record->group->name();
    statistics.callback = record->entity->name();
    statistics.kind = record->description.kind;
    statistics.topic = report.topic;
    statistics.dropped = report.dropped;
    statistics.overruns = report.missed;
    statistics.expected = record->is_timer() ? statistics.received : report.expected;
    result.push_back(std::move(statistics));
  }
  return result;
}

std::vector<ThreadStatistics> DispatchingExecutor::thread_statistics() const {
  const std::lock_guard lock(control_mutex_);
  if (spinning_.load()) {
    throw Error("executor '" + options_.name + "' is spinning", "read its statistics afterwards");
  }
  return thread_statistics_;
}

}  // namespace takt
