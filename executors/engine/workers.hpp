// How the workers of an executor wait: how one searches, sleeps and is woken.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_WORKERS_HPP_
#define TAKT_EXECUTORS_ENGINE_WORKERS_HPP_

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "takt/executors/engine/dispatch_lock.hpp"
#include "takt/executors/engine/places.hpp"
#include "takt/executors/engine/ready_set.hpp"
#include "takt/executors/engine/schedule_update.hpp"
#include "takt/executors/executor.hpp"

namespace takt {
class ManualWaitBackend;
}

namespace takt::detail {

class Dispatcher;

/// A thread of an executor. The one that spins has index 0.
/// Thread safety: its own thread uses it; the dispatch lock guards the fields that others read.
struct alignas(64) Worker {
  std::size_t index = 0;
  ThreadAttributes attributes = {};
  Dispatcher* dispatcher = nullptr;
  TraceRing trace = TraceRing();
  bool may_search = false;         // no thread of the pool is more urgent
  TimePoint waits_until = kNever;  // the release that ends its wait; guarded by the lock
  Nanoseconds spin_time{0};        // since spin began
  std::uint64_t allocations = 0;   // of the thread, up to the end of its last callback
  Worker* outer = nullptr;         // in a nested spin: the worker in whose callback it spins

  /// The calling thread's worker; nullptr: it has none. A thread of a pool has one until it ends.
  static Worker* current() noexcept { return current_; }
  /// Whether the calling thread is the only worker of this executor.
  static bool is_only_one_of(const Dispatcher& dispatcher) noexcept;
  /// The allocations of this thread since the last call.
  std::uint64_t take_allocations() noexcept {
    const std::uint64_t all = allocations_of_this_thread();
    return all - std::exchange(allocations, all);
  }
  void enter() noexcept {
    outer = std::exchange(current_, this);
    take_allocations();  // restarts the count: earlier ones belong to no callback
  }
  void leave() noexcept { current_ = outer; }

 private:
  // For the TLS model, see Dispatch::current_.
  [[gnu::tls_model("initial-exec")]] static thread_local constinit Worker* current_;
};

/// All workers of an executor. A worker that finds nothing to run searches for a moment, then it
/// sleeps; one of the waiting workers wakes up for the first timer.
/// Thread safety: as the sections say; "with the lock": the caller holds it before and after.
/// Real-time: nothing allocates; notify costs three loads, or wakes one thread.
class Workers final : public Wakeable {
 public:
  /// The state of the searcher, the one worker of a pool that polls instead of sleeping.
  enum class Search : std::uint8_t {
    none,    // there is no searcher: a sleeper is woken
    quiet,   // nothing was announced since its last look
    asked,   // something was announced: the next look takes what the announcing worker has left
    called,  // it must stop searching: there is something to run, or a release to wait for
  };

  /// `policy`: nullptr if any worker may take each callback.
  Workers(const ExecutorOptions& options, const std::vector<ThreadAttributes>& threads,
          const WorkersPolicy* policy, Dispatcher& dispatcher, ReadySet& ready,
          const Updates& updates);

  DispatchLock& lock() noexcept TAKT_RETURNS_LOCK(lock_) { return lock_; }
  const DispatchLock& lock() const noexcept TAKT_RETURNS_LOCK(lock_) { return lock_; }

  std::vector<Worker>& all() noexcept { return all_; }
  const std::vector<Worker>& all() const noexcept { return all_; }
  Places& places() noexcept { return places_; }

  /// The workers that may take the callback. Throws Error if there are none.
  WorkerSet that_may_take(const NamedCallback& callback) const;
  // ---- Any thread ----

  /// Wakes the searcher, or a sleeper: there is something to do.
  void notify(Search what) noexcept;
  /// The callback has become ready.
  void notify_of(const CallbackRecord& record) noexcept {
    if (!are_apart_.load()) return notify(Search::asked);
    // If it may not interrupt, it waits for the end of a callback, where a worker finds it.
    if (ready_.selection().interrupts() && !ready_.selection().may_interrupt(record)) return;
    places_.wake_one_of(record.workers.load());
  }
  /// A pool begins or ends a spin. Without a pool the calling thread is the only worker, and takes
  /// all callbacks.
  void set_pool(bool spins) noexcept {
    are_apart_.store(spins && policy_ != nullptr && lock_.is_shared());
  }
  /// The index by which the worker's callbacks are selected; kAnyWorker: it may take all.
  std::size_t number_of(const Worker& worker) const noexcept {
    return are_apart_.load(std::memory_order_relaxed) ? worker.index : Selection::kAnyWorker;
  }
  void wake() noexcept override { notify(Search::called); }
  void wake_all() noexcept;
  /// Makes all workers return from spin. Sticky: it holds until take_stop.
  void stop() noexcept {
    stops_.store(true);
    wake_all();
  }
  bool stopping() const noexcept { return stops_.load(); }
  bool take_stop() noexcept { return stops_.exchange(false); }
  /// The observer is woken when a callback becomes ready and no worker sleeps.
  void set_observer(Wakeable* observer) noexcept { observer_.store(observer); }

  // ---- Workers, with the lock ----

  void begin(Worker& worker) noexcept TAKT_REQUIRES(lock_) {
    worker.spin_time = Nanoseconds::zero();
    worker.take_allocations();
    ++working_;
  }
  void end() noexcept TAKT_REQUIRES(lock_) { --working_; }
  void look_at_file_descriptors() noexcept TAKT_REQUIRES(lock_);
  /// A worker is about to execute: wakes another one if more callbacks could run in parallel, or if
  /// no worker waits for the first timer.
  void pass_on() noexcept TAKT_REQUIRES(lock_) {
    if (!lock_.is_shared()) return;
    if (are_apart_.load(std::memory_order_relaxed)) [[unlikely]]
      return pass_on_to_each();
    if (!places_.sleepers_of(0).would_wake() && searcher_.state.load() == Search::none) return;
    if (ready_.next_release() < first_wait_ || ready_.has_another()) wake();
  }
  /// There was nothing to run. Returns true if the worker must look again, false at the limit.
  bool wait(Worker& worker, TimePoint limit, const FutureState* future) noexcept
      TAKT_REQUIRES(lock_);

 private:
  [[gnu::noinline]] void pass_on_to_each() noexcept TAKT_REQUIRES(lock_);

  /// What ends a worker's wait besides announcements, and what was so when it began.
  struct Expected {
    const FutureState* future;
    bool timers_were_held;  // when the worker read the next release
    bool others_work;       // another worker of the pool was awake
  };

  /// Whether there is a reason not to sleep.
  bool must_look(const Worker& worker, const Expected& expected) const noexcept {
    return ready_.has_announcements() ||
           (are_apart_.load() && (ready_.selection().may_run(worker.index) ||
                                  ready_.worker_for_next() == worker.index)) ||
           updates_.is_pending() || stops_.load() ||
           ready_.timers().timers_are_held() != expected.timers_were_held ||
           (expected.future != nullptr && expected.future->ready());
  }
  void set_wait(Worker& worker, TimePoint until) noexcept TAKT_REQUIRES(lock_);
  TimePoint own_release(const Worker& worker) const noexcept TAKT_REQUIRES(lock_);
  TimePoint release_to_wait_for(const Worker& worker) const noexcept TAKT_REQUIRES(lock_);
  bool may_search(const Worker& worker) const noexcept {
    return !lock_.is_shared() || (worker.may_search && searcher_.state.load() == Search::none);
  }
  Nanoseconds patience_of(const Worker& worker, const Expected& expected) const noexcept
      TAKT_REQUIRES(lock_);
  bool search(Worker& worker, TimePoint until, Nanoseconds patience,
              const Expected& expected) noexcept TAKT_REQUIRES(lock_);

  const ExecutorOptions& options_;
  const WorkersPolicy* const policy_;
  const bool yields_;  // a searcher yields, as all workers share one CPU
  DispatchLock lock_;
  ReadySet& ready_;
  const Updates& updates_;
  std::vector<Worker> all_;
  Places places_;
  std::size_t working_ TAKT_GUARDED_BY(lock_) = 0;  // workers that have begun and have not ended
  TimePoint first_wait_ TAKT_GUARDED_BY(lock_) = kNever;  // the first release for which one waits
  TimePoint last_look_ TAKT_GUARDED_BY(lock_){};          // when a busy worker last polled files

  /// The searcher. On virtual CPUs, where a look takes no time, it is called instead.
  struct Searcher {
    std::atomic<Search> state{Search::none};
    std::atomic<std::size_t> index{0};
    ManualWaitBackend* is_called_by = nullptr;
  } searcher_;
  std::atomic<bool> stops_{false};
  std::atomic<bool> are_apart_{false};  // a workers' policy tells those of a pool apart
  std::atomic<Wakeable*> observer_{nullptr};
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_WORKERS_HPP_
