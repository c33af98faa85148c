// The engine of the named executors: readiness × scheduler × threads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_DISPATCHING_EXECUTOR_HPP_
#define TAKT_EXECUTORS_DISPATCHING_EXECUTOR_HPP_

#include <atomic>
#include <memory>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/ready_set.hpp"
#include "takt/executors/wait_backend.hpp"

namespace takt {

/// What distinguishes one named executor from another.
struct ExecutorTraits {
  Readiness readiness;
  const char* scheduler;    // unless the options name one
  std::size_t max_threads;  // options that give more are refused
  bool pool = false;        // without thread options: as many threads as CPUs, at least two
  bool frozen = false;      // nothing is added or removed after the first spin
};

/// How it works:
/// 1. An entity announces itself to its record, on whatever thread: the record goes into the ready
///    set's inbox, and one sleeping worker is woken, if there is one.
/// 2. A worker takes the dispatch lock (only where there is more than one worker), picks a callback
///    from the ready set, and executes it without the lock.
/// 3. When there is nothing to pick, the worker sleeps. One of the sleepers keeps time: it wakes
///    when the first timer is due.
/// 4. What control threads change, they build as a plan; a worker installs it at its next
///    dispatch. While nobody spins, the control thread installs it itself.
class DispatchingExecutor : public Executor, private NodeListener, private Wakeable {
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
  bool is_spinning() const noexcept override { return spinning_.load(); }
  std::size_t max_threads() const noexcept override { return traits_.max_threads; }
  void release_timers(bool released) noexcept override {
    ready_.release_timers(released);
    wake();  // who keeps time must look anew
  }
  std::size_t pending() const noexcept override;
  std::vector<CallbackStatistics> statistics() const override;
  std::vector<ThreadStatistics> thread_statistics() const override;

  // For executors that are made of others (isolated) and run them on one thread.

  /// Runs one callback if one is ready.
  bool run_one();
  /// Takes back a cancel that has come after the end of spin.
  void forget_cancel() noexcept { cancelled_.store(false); }
  /// When the first timer is due; ask only while nobody spins.
  TimePoint next_release() const noexcept { return ready_.next_release(); }
  /// Is woken when something becomes ready and no thread of ours sleeps.
  void set_observer(Wakeable* observer) noexcept { observer_.store(observer); }

 protected:
  FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) override;

 private:
  struct Record;
  class Spin;

  // Control threads.
  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override;
  void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) override;
  void refuse_when_frozen(const char* what) const;
  void add_group(const std::shared_ptr<CallbackGroup>& group, Node& node);
  void add_entity(const std::shared_ptr<Entity>& entity, const Node& node);
  void release_group(CallbackGroup& group, const Node& node) noexcept;
  void remove(Record& record) noexcept;
  void hand_plan_over();
  std::vector<std::unique_ptr<Record>> take_what_is_gone() noexcept;
  void remember(const std::shared_ptr<Node>& node);

  // Workers.
  void lock() noexcept {
    if (shared_) mutex_.lock();
  }
  void unlock() noexcept {
    if (shared_) mutex_.unlock();
  }
  void start_worker(std::size_t index);
  bool run_next(const ReadySet::Limits& limits) noexcept;
  void execute(CallbackRecord& record) noexcept;
  void caught(std::exception_ptr exception) noexcept;
  void record_run(CallbackRecord& record, const Slot& slot, TimePoint start) noexcept;
  bool sleep(std::size_t index, TimePoint limit, const FutureState* future = nullptr) noexcept;
  void install_plan() noexcept;
  void pass_on() noexcept;
  void wake() noexcept override;
  void wake_all() noexcept;
  bool claim_idle() noexcept;
  bool stopping() const noexcept { return cancelled_.load() || exception_ != nullptr; }
  void rethrow();

  const ExecutorOptions options_;
  const ExecutorTraits traits_;
  const std::string scheduler_;
  std::vector<ThreadAttributes> threads_;  // one for each worker
  const bool shared_;                      // more than one worker
  const bool records_times_;               // statistics are full
  bool reads_clock_;                       // at every dispatch
  const std::unique_ptr<WaitBackend> backend_;

  // Guarded by mutex_ where there is more than one worker.
  PiMutex mutex_;
  ReadySet ready_;
  std::exception_ptr exception_;
  ExceptionHandler handler_;
  static constexpr std::size_t kNobody = SIZE_MAX;
  std::size_t timekeeper_ = kNobody;  // the worker that sleeps until the first timer is due
  TimePoint timekeeper_deadline_{};

  alignas(64) std::atomic<std::size_t> idle_{0};  // workers that sleep and have not been woken
  std::atomic<bool> cancelled_{false};
  std::atomic<bool> spinning_{false};
  std::atomic<Wakeable*> observer_{nullptr};
  std::atomic<ReadyPlan*> plan_{nullptr};  // handed over, not yet installed
  Inbox<ReadyPlan> used_plans_;            // installed; hold what they replaced

  // Guarded by control_mutex_.
  mutable PiMutex control_mutex_;
  std::vector<std::unique_ptr<Record>> records_;
  std::vector<std::unique_ptr<Record>> removed_records_;  // until nobody can touch them
  ReadyPlan changes_;                                     // only its lists are used
  bool has_changes_ = false;
  bool was_spun_ = false;
  CallbackId next_callback_id_ = 0;
  std::vector<std::pair<const void*, std::uint32_t>> group_ids_, node_ids_;
  std::vector<std::weak_ptr<Node>> nodes_;
  std::vector<ThreadStatistics> thread_statistics_;
  std::atomic<std::size_t> expected_removals_{0};
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_DISPATCHING_EXECUTOR_HPP_
