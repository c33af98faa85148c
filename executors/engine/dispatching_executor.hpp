// The engine of the named executors: readiness × scheduler × threads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_DISPATCHING_EXECUTOR_HPP_
#define TAKT_EXECUTORS_ENGINE_DISPATCHING_EXECUTOR_HPP_

#include <atomic>
#include <map>
#include <memory>
#include <thread>
#include <unordered_map>
#include <vector>

#include "takt/base/held_locks.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/entities/staged_outputs.hpp"
#include "takt/executors/engine/dispatch_lock.hpp"
#include "takt/executors/engine/numbers.hpp"
#include "takt/executors/engine/past_statistics.hpp"
#include "takt/executors/engine/ready_set.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {

/// Throws Error if `spin` or `early_wake` is out of its limits, or if these threads, instead of
/// those of the options, cannot spin always.
void check_spin(const ExecutorOptions& options, std::span<const ThreadAttributes> threads);

/// Runs the callbacks of its nodes: the engine of the named executors.
/// 1. An entity announces itself to its record, on whatever thread: the record goes into the ready
///    set's inbox, and one sleeping worker is woken, if there is one.
/// 2. A worker takes the dispatch lock (only where there is more than one worker), picks a callback
///    from the ready set, and executes it without the lock.
/// 3. When there is nothing to pick, the worker waits: it may search for a moment, then it sleeps.
///    One of those that wait does so until the first timer is due.
/// 4. A control thread builds a change as an update; a worker installs it at its next dispatch.
///    While no thread spins, the control thread installs it itself.
/// Thread safety and real-time: as Executor.
class DispatchingExecutor : public Executor, private Wakeable {
  using CallbackRecord = detail::CallbackRecord;
  using CallbackSettings = detail::CallbackSettings;
  using Execution = detail::Execution;
  using ReadySet = detail::ReadySet;
  using ScheduleUpdate = detail::ScheduleUpdate;

 public:
  DispatchingExecutor(const ExecutorOptions& options, const ExecutorTraits& traits);
  ~DispatchingExecutor() override;

  void add_node(const std::shared_ptr<Node>& node) override;
  void remove_node(const std::shared_ptr<Node>& node) override;
  void add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                          const std::shared_ptr<Node>& node) override;
  void remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                             const std::shared_ptr<Node>& node) override;

  using Executor::spin;
  void spin(const ExceptionHandler& handler) override;
  void spin_once(Nanoseconds timeout) override;
  void spin_some(Nanoseconds max_duration) override;
  void spin_all(Nanoseconds max_duration) override;
  void cancel() noexcept override;
  bool is_spinning() const noexcept override { return has_workers_.load(); }
  void release_timers(bool released) noexcept override {
    ready_.release_timers(released);
    timers_held_.store(released ? TimePoint{} : options_.clock->now());
    wake();  // the worker that waits for the first one must look again
  }
  std::size_t pending() const noexcept override;
  std::vector<CallbackStatistics> statistics() const override;
  std::vector<ThreadStatistics> thread_statistics() const override;

  // For executors that are made of others (isolated) and run them on one thread.

  /// Runs one callback if one is ready.
  bool run_one();
  /// As remove_callback_group, for all of these groups that belong to this executor; `with_node`:
  /// and for the node.
  void release_groups(std::vector<std::shared_ptr<CallbackGroup>> groups, Node& node,
                      bool with_node = false) noexcept;
  /// Whether it has callbacks, or the node or one of its groups belongs to it. Callbacks may live
  /// longer than their node: then `node` is nullptr.
  bool is_used_by(const Node* node) const;
  /// Discards a cancel that arrived after the end of spin.
  void forget_cancel() noexcept { cancelled_.store(false); }
  /// When the first timer is due. Call it only while no thread spins; other threads may remove
  /// timers meanwhile.
  TimePoint next_release() const noexcept {
    const std::lock_guard lock(control_mutex_);
    return ready_.next_release();
  }
  /// A descriptor for another wait back end, ready when a file descriptor of this executor is; -1
  /// if it has none. Call it only on the thread of the last spin, after that spin.
  int wait_fd() const noexcept { return watched_.load() == 0 ? -1 : backend_->fd(); }
  /// The observer is woken when a callback becomes ready and no worker sleeps.
  void set_observer(Wakeable* observer) noexcept { observer_.store(observer); }

 protected:
  FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) override;

 private:
  struct Record;
  using Records = std::vector<std::unique_ptr<Record>>;
  class Spin;

  /// The watchdog calls it from its thread: a member, which is complete before the executor is.
  struct Watched final : Watchdog::Watched {
    explicit Watched(DispatchingExecutor& of) : executor(of) {}
    TimePoint report_misses(TimePoint now) noexcept override { return executor.report_misses(now); }
    DispatchingExecutor& executor;
  };

  /// Nodes call it from any thread: a member, which lives until no call can come.
  struct Listener final : NodeListener {
    explicit Listener(DispatchingExecutor& of) : executor(of) {}
    void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override {
      executor.entity_added(node, entity);
    }
    void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) override {
      executor.group_added(node, group);
    }
    void parameters_changed(Node& node) override { executor.parameters_changed(node); }
    DispatchingExecutor& executor;
  };

  /// Logical execution time.
  struct Let {
    explicit Let(const TriggerOptions& options)
        : period(options.let_period), outputs(options.most_outputs) {}
    const Nanoseconds period;
    StagedOutputs outputs;
    TimePoint next{};  // end of the period
    std::uint64_t missed = 0;
    std::shared_ptr<std::vector<detail::Execution>> taken;  // with room for all callbacks
  };

  // Control threads.
  void entity_added(Node& node, const std::shared_ptr<Entity>& entity);
  void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group);
  void parameters_changed(Node& node);
  CallbackSettings settings(const Record& record, const Node& node) const;
  TimePoint report_misses(TimePoint now) noexcept;
  void refuse_when_frozen(const char* what) const;
  void choose_wait_backend();
  void watch(Record& record);
  void unwatch(Record& record) noexcept;
  void add_group(const std::shared_ptr<CallbackGroup>& group, Node& node);
  void add_entity(const std::shared_ptr<Entity>& entity, const Node& node);
  void undo_add(Record& record) noexcept;
  void wait_until_over(const Record& record) noexcept;
  static void mark_removed(Record& record) noexcept;
  static void detach(Record& record) noexcept;
  void wait_for_removal(Record& record) noexcept;
  std::uint64_t begin_removal(const void* what);
  bool ends_removal(const void* what, std::uint64_t removal) noexcept;
  void removal_is_over(std::size_t count) noexcept;
  void wait_for_removals() noexcept;
  bool claim_removal(Record& record) noexcept;
  void remove(const std::vector<Record*>& records) noexcept;
  void take_from_lists(Record& record) noexcept;
  void remove_at_rest(const std::vector<Record*>& records) noexcept;
  void publish_update();
  void publish_removal() noexcept;
  std::unique_ptr<ScheduleUpdate> make_update(const ScheduleUpdate* earlier) const;
  void configure(ScheduleUpdate& update) const;
  void hand_over(std::unique_ptr<ScheduleUpdate> update) noexcept;
  void send(std::unique_ptr<ScheduleUpdate> update) noexcept;
  Records take_unused() noexcept;
  CallbackStatistics statistics_of(const Record& record) const;
  void remember_statistics_of(const Record& record);
  void remember(const std::shared_ptr<Node>& node);

  // Workers.
  void lock() noexcept {
    if (shared_) lock_.lock();
  }
  void unlock() noexcept {
    if (shared_) [[unlikely]]
      lock_.unlock();
  }
  void start_worker(std::size_t index);
  void work(std::size_t index);
  bool run_next(const ReadySet::Limits& limits) noexcept;
  bool take(CallbackRecord& record, Slot& slot) noexcept;
  [[gnu::cold, gnu::noinline]] bool run_period() noexcept;
  void execute(CallbackRecord& record, const ReadyCallback& as_picked, TimePoint picked,
               bool is_checked, Slot& slot, bool taken, StagedOutputs* outputs) noexcept;
  void call(CallbackRecord& record, Slot& slot) noexcept {
    const bool outer_runs_again = shared_ && std::exchange(runs_again_, false);
    try {
      detail::expect_no_lock("callback");
      record.entity->execute(slot);
    } catch (...) {
      caught(record, std::current_exception());
    }
    if (shared_ && std::exchange(runs_again_, outer_runs_again)) slot.more = true;
  }
  struct Usage {
    Nanoseconds cpu_time{0};
    std::int64_t waits = 0;  // how often it gave up the CPU by itself; not where it was preempted
    Usage operator-(const Usage& before) const noexcept {
      return {cpu_time - before.cpu_time, waits - before.waits};
    }
  };
  /// What the calling thread has used so far: read before a traced execution begins and after it
  /// has ended, as that takes longer than many a callback.
  [[gnu::cold, gnu::noinline]] static Usage usage_of_thread() noexcept;
  /// A callback so brief leaves the dispatch in the caches, which then takes as long as a reading
  /// of the clock.
  static constexpr Nanoseconds kBrief{500};
  /// A pointer was taken, right after a brief callback on the only worker: when that has ended says
  /// as much as another reading.
  bool starts_at_once(const CallbackRecord& record, const Slot& slot) const noexcept {
    return !shared_ && has_just_run_ && trace_of_ == nullptr &&
           record.settings.info.kind == EntityKind::subscription &&
           slot.message->origin.writer == 0;
  }
  /// The group of the callback that the thread is in.
  static const Exclusion* group_inside() noexcept {
    const Dispatch* const dispatch = Dispatch::current();
    return dispatch != nullptr ? dispatch->group : nullptr;
  }
  [[gnu::cold, gnu::noinline]] void watch_execution(CallbackRecord& record) noexcept;
  void discard(CallbackRecord& record, Slot& slot) noexcept;
  [[gnu::cold, gnu::noinline]] void caught(const CallbackRecord& record,
                                           std::exception_ptr exception) noexcept;
  [[gnu::cold, gnu::noinline]] void trace(CallbackRecord& record, const Slot& slot,
                                          TimePoint picked, TimePoint start, TimePoint end,
                                          const Usage& used) noexcept;
  [[gnu::cold, gnu::noinline]] void check_limits(CallbackRecord& record, const Slot& slot,
                                                 const Dispatch& dispatch, TimePoint start,
                                                 TimePoint end) noexcept;
  void record_times(CallbackRecord& record, const Slot& slot, TimePoint picked, TimePoint start,
                    TimePoint end) noexcept;
  bool has_time_left(TimePoint limit) noexcept;
  void set_wait(std::size_t index, TimePoint until) noexcept;
  TimePoint release_to_wait_for() const noexcept;
  bool may_search(std::size_t index) const noexcept {
    return !shared_ || (may_search_[index] && search_.load() == Search::none);
  }
  Nanoseconds patience_of(std::size_t index) const noexcept;
  bool search(std::size_t index, TimePoint until, Nanoseconds patience,
              const FutureState* future) noexcept;
  bool wait(std::size_t index, TimePoint limit, const FutureState* future = nullptr) noexcept;
  void install_update() noexcept {
    if (update_.load(std::memory_order_relaxed) != nullptr) [[unlikely]]
      install_pending_update();
  }
  [[gnu::cold, gnu::noinline]] void install_pending_update() noexcept;
  static void install_updates_here() noexcept;
  void look_at_file_descriptors() noexcept;
  void pass_on() noexcept;
  TimePoint first_release() const noexcept {
    return let_ != nullptr ? let_->next : ready_.next_release();
  }
  void announce(CallbackRecord& record, Arrival arrival) noexcept;
  /// What the worker of a pool that searches instead of sleeping has to do. One does at a time.
  enum class Search : std::uint8_t {
    none,    // nobody searches: a sleeper is woken
    quiet,   // nothing has come since it last looked
    asked,   // something was announced: it looks whether the announcing worker has taken that
    called,  // it has to come: there is something to run, or to wait for
  };
  void notify(Search what) noexcept;
  void wake() noexcept final { notify(Search::called); }
  void wake_all() noexcept;
  bool claim_idle() noexcept;
  /// Something for which a sleeper wakes up.
  bool has_announcements() const noexcept { return let_ == nullptr && ready_.has_announcements(); }
  /// The same, and all else for which one does; exceptions excepted, which the lock guards.
  bool must_look(const FutureState* future) const noexcept {
    return has_announcements() || update_.load() != nullptr || cancelled_.load() ||
           (future != nullptr && future->ready());
  }
  bool stopping() const noexcept { return cancelled_.load() || exception_ != nullptr; }
  void rethrow();

  // The executor whose worker the calling thread is: a removal from it must not wait for this
  // thread.
  static thread_local constinit DispatchingExecutor* worker_of_;
  // The innermost of its spins; nullptr on the threads of a pool.
  static thread_local constinit Spin* spin_of_;

  // Which of its workers: the thread that spins has index 0.
  static thread_local constinit std::size_t place_;

  // In a pool: the callback that this worker is in has announced itself.
  static thread_local constinit bool runs_again_;

  // Where that worker traces; nullptr when nothing is traced.
  static thread_local constinit TraceRing* trace_of_;

  const ExecutorOptions options_;
  const ExecutorTraits traits_;
  const std::string scheduler_;
  std::vector<ThreadAttributes> threads_;  // one for each worker
  const bool shared_;                      // more than one worker
  const bool is_parallel_;                 // and they run at the same time
  const std::vector<bool> may_search_;     // each worker of a pool
  const bool records_times_;               // statistics are full
  const bool times_take_;  // the callback's start is read, as it is later than the pick
  const Nanoseconds spin_, early_wake_;   // under a manual clock neither takes time
  std::unique_ptr<WaitBackend> backend_;  // `auto`: made at the first spin

  const std::unique_ptr<detail::Trigger> trigger_;  // nullptr: whenever something is ready
  const std::unique_ptr<Let> let_;                  // nullptr: none

  // Guarded by lock_ where there is more than one worker.
  detail::DispatchLock lock_;
  ReadySet ready_;
  std::exception_ptr exception_;
  ExceptionHandler handler_;
  std::vector<Nanoseconds> spin_times_;  // of each worker, since spin began
  std::size_t workers_ = 0;              // that have begun to work and have not ended
  std::vector<TimePoint> waits_;         // until which release each worker waits; else kNever
  TimePoint first_wait_ = kNever;        // the first of these
  TimePoint last_look_{};                // at file descriptors, when no worker sleeps

  alignas(64) std::atomic<std::size_t> idle_{0};  // workers that sleep and have not been woken
  std::atomic<Search> search_{Search::none};
  std::atomic<bool> cancelled_{false};
  std::atomic<bool> spinning_{false};     // in any kind of spin
  std::atomic<bool> has_workers_{false};  // and all its threads exist
  std::atomic<Wakeable*> observer_{nullptr};
  std::atomic<ScheduleUpdate*> update_{nullptr};  // handed over, not yet installed
  std::atomic<std::size_t> watched_{0};           // file descriptors
  Inbox<ScheduleUpdate> used_updates_;            // installed; hold what they replaced

  // Guarded by control_mutex_.
  mutable PiMutex control_mutex_;
  std::map<CallbackId, std::unique_ptr<Record>> records_;  // in order of registration
  std::unordered_map<const Entity*, Record*> of_entity_;   // the same
  Records removed_;                                        // until nothing refers to them
  // Groups and nodes that one or more threads are removing, with the number of the removal: the
  // first thread that finishes ends it for all.
  std::map<const void*, std::uint64_t> removals_;
  std::uint64_t last_removal_ = 0;
  detail::PastStatistics past_;  // of removed callbacks
  bool is_ending_ = false;       // no more statistics are kept
  ScheduleUpdate changes_;       // only `removed` and `changed`
  bool has_changes_ = false;
  std::atomic<TimePoint> timers_held_{};  // since when; {}: they are not
  bool has_just_run_ = false;             // a brief callback, and nothing else since
  bool was_spun_ = false;
  CallbackId next_callback_id_ = 0;
  detail::Numbers<Exclusion> group_ids_;
  detail::Numbers<const Node> node_ids_;
  std::vector<std::weak_ptr<Node>> nodes_;
  std::vector<ThreadStatistics> thread_statistics_;
  std::vector<TraceRing> traces_;  // one for each worker, or none
  Listener listener_{*this};
  Watched watched_callbacks_{*this};
  std::atomic<std::size_t> expected_removals_{0};
};

struct DispatchingExecutor::Record final : detail::CallbackRecord {
  explicit Record(DispatchingExecutor& owner) : executor(owner) {}
  ~Record() { release_entity(); }
  DispatchingExecutor& executor;
  // Guarded by control_mutex_.
  CallbackSettings wanted;                                    // from the next update on
  bool is_handed_over = false;                                // to the ready set, by an update
  bool is_watched = false;                                    // its file descriptor
  CallbackId key() const noexcept { return wanted.info.id; }  // never changes

  void announce(Arrival arrival) noexcept override {
    if (worker_of_ != &executor) return executor.announce(*this, arrival);
    if (!executor.shared_) return executor.ready_.announce_from_worker(*this, arrival);
    if (is_inside()) {
      runs_again_ = true;  // the worker looks for more when it returns
    } else {
      executor.announce(*this, arrival);
    }
  }
  bool takes_here() const noexcept override { return worker_of_ == &executor && !executor.shared_; }
  void release_changed() noexcept override {
    if (executor.ready_.announce(*this, {})) executor.wake();
  }
  void remove() noexcept override { executor.remove({this}); }
  void expect_remove() noexcept override {
    expect_wait();
    entity->add_earlier_owner(*this);
  }
  void expect_wait() noexcept override {
    executor.expected_removals_.fetch_add(1);
    state.retain();
  }
  void wait_for_removal() noexcept override {
    DispatchingExecutor& waits_for_us = executor;
    waits_for_us.wait_for_removal(*this);
    state.release();
    waits_for_us.removal_is_over(1);
  }
  bool is_detached() const noexcept override { return state.is_detached(); }
  bool wants_time() const noexcept override { return executor.ready_.exact_time(); }
  /// Whether the calling thread is in its callback, and that excludes all others of the group.
  bool is_inside() const noexcept {
    return !is_reentrant() && group_inside() == exclusion.get() && state.is_executing();
  }

  /// True: no thread uses the record, and none begins to wait for it any more.
  bool may_be_freed() noexcept {
    const std::lock_guard ownership(ownership_mutex());
    if (!state.is_unused()) return false;
    forget_earlier_owner();
    return true;
  }
  /// As the destructor does.
  std::shared_ptr<Entity> release_entity() noexcept {
    if (entity == nullptr) return nullptr;
    const std::lock_guard ownership(ownership_mutex());
    forget_earlier_owner();
    return std::move(entity);
  }
  /// With ownership_mutex held.
  void forget_earlier_owner() noexcept {
    if (entity != nullptr) entity->forget_earlier_owner(*this);
  }
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_DISPATCHING_EXECUTOR_HPP_
