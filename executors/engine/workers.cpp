// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/workers.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <sched.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/error.hpp"
#include "takt/base/spin_pause.hpp"
#include "takt/base/tracepoints.hpp"
#include "takt/executors/pool_search.hpp"
#include "takt/executors/virtual_cpus.hpp"
#include "takt/executors/wait_backends/manual.hpp"

namespace takt::detail {
namespace {

// How long the searcher leaves an announced callback to the worker that announced it: that worker
// usually takes it soon, and has its data in the cache. Each announcement begins a moment anew, but
// not for ever: a worker may be long in a callback while another thread announces.
constexpr Nanoseconds kMoment(1'000);
constexpr int kMomentsInARow = 4;

// Whether all threads share one CPU, so that a searcher should yield. Not with SCHED_DEADLINE,
// where sched_yield() gives up the rest of the runtime.
bool share_a_cpu(const std::vector<ThreadAttributes>& threads, Clock& clock) {
  const bool is_only_one =
      (has_virtual_cpus(clock) ? clock.as_manual()->cpus() : available_cpus().size()) == 1;
  const std::vector<int>& first = threads.front().affinity;
  return threads.size() > 1 && (is_only_one || first.size() == 1) &&
         std::all_of(threads.begin(), threads.end(), [&](const ThreadAttributes& thread) {
           return thread.policy != ThreadPolicy::deadline &&
                  (is_only_one || thread.affinity == first);
         });
}

}  // namespace

[[gnu::tls_model("initial-exec")]] thread_local constinit Worker* Worker::current_ = nullptr;

Workers::Workers(const ExecutorOptions& options, const std::vector<ThreadAttributes>& threads,
                 const WorkersPolicy* policy, Dispatcher& dispatcher, ReadySet& ready,
                 const Updates& updates)
    : options_(options),
      policy_(policy),
      yields_(share_a_cpu(threads, *options.clock)),
      lock_(threads.size() > 1),
      ready_(ready),
      updates_(updates),
      all_(threads.size()),
      places_(options, threads.size(), policy != nullptr) {
  const bool is_manual = options.clock->as_manual() != nullptr;
  const bool may_any_search = policy == nullptr && (!is_manual || has_virtual_cpus(*options.clock));
  for (std::size_t i = 0; i < threads.size(); ++i) {
    const ThreadAttributes& thread = threads[i];
    const auto is_not_above = [&](const auto& other) {
      return other.policy == thread.policy && other.priority <= thread.priority &&
             other.nice >= thread.nice;
    };
    all_[i].index = i;
    all_[i].attributes = thread;
    all_[i].dispatcher = &dispatcher;
    if (options.trace_events != 0) all_[i].trace.begin(options.trace_events);
    all_[i].may_search = lock_.is_shared() && may_any_search &&
                         std::all_of(threads.begin(), threads.end(), is_not_above);
  }
  if (options.wait != kAutoWait || is_manual) places_.choose(false);
  if (has_virtual_cpus(*options.clock))
    searcher_.is_called_by = static_cast<ManualWaitBackend*>(&places_.backend_of(0));
}

// Sleeping workers are woken for file descriptors. While none sleeps, a busy one polls them from
// time to time; under a manual clock, which does not watch them, at every dispatch.
void Workers::look_at_file_descriptors() noexcept {
  constexpr Nanoseconds kBetweenLooks(50'000);
  const TimePoint now = options_.clock->now();
  if (options_.clock->as_manual() == nullptr && now - last_look_ < kBetweenLooks) return;
  last_look_ = now;
  places_.look();
}

WorkerSet Workers::that_may_take(const NamedCallback& callback) const {
  const WorkerSet all = ~WorkerSet{} >> (kMostWorkers - std::min(all_.size(), kMostWorkers));
  if (policy_ == nullptr) return all;
  std::vector<ThreadAttributes> threads;
  for (const Worker& worker : all_) threads.push_back(worker.attributes);
  if (const WorkerSet set = policy_->workers_of(callback, threads) & all; set != 0) return set;
  throw Error(fmt::format("executor '{}': no thread may take callback '{}' of '{}'", options_.name,
                          callback.callback, callback.node),
              "let its workers' policy name one, or give the executor more threads");
}

// ---- What wakes a worker ----

// Dekker's algorithm: the caller writes the work, then reads the workers' states; a worker writes
// its state (it searches no more, or is idle), then reads the work. All of that is sequentially
// consistent, so one of the two threads sees what the other has written. Without a searcher and
// sleepers it costs three loads.
void Workers::notify(Search what) noexcept {
  for (Search state = searcher_.state.load(); state != Search::none;) {
    if (state == Search::called && what == Search::called) break;  // still searching: preempted?
    if (state >= what || searcher_.state.compare_exchange_weak(state, what)) {
      if (searcher_.is_called_by != nullptr) [[unlikely]]
        searcher_.is_called_by->call(searcher_.index.load());
      return;
    }
  }
  if (places_.wake_one_of(~WorkerSet{})) return;
  if (Wakeable* observer = observer_.load()) observer->wake();
}

void Workers::wake_all() noexcept {
  wake();
  places_.wake_all();
}

// Wakes each sleeping worker that has a callback to run, or a release before the one for which it
// waits: while this worker executes or sleeps, nobody else would. A callback is counted before the
// sleepers are read, and a worker that goes to sleep says so before it reads the count: no wake-up
// is lost.
void Workers::pass_on_to_each() noexcept {
  if (ready_.selection().is_open()) ready_.take_snapshot();
  const std::optional<std::size_t> next = ready_.worker_for_next();
  for (Worker& other : all_) {
    if (!places_.sleepers_of(other.index).would_wake()) continue;
    const TimePoint release = own_release(other);
    const bool must_wait = release < other.waits_until;
    if (must_wait) other.waits_until = release;  // later workers need not wait for it
    if (must_wait || ready_.selection().may_run(other.index) || other.index == next)
      places_.wake_one_of(WorkerSet{1} << other.index);
  }
}

// ---- What a worker does that waits ----

// The first release that this worker may take, and for which no worker before it waits.
TimePoint Workers::own_release(const Worker& worker) const noexcept {
  return ready_.next_release_of([&](const CallbackRecord& record, TimePoint release) {
    const WorkerSet may_take = record.settings.workers;
    const Selection& selection = ready_.selection();
    if (selection.interrupts() && !selection.may_interrupt(record)) return false;
    return (may_take >> worker.index & 1) != 0 &&
           std::none_of(all_.begin(), all_.begin() + static_cast<std::ptrdiff_t>(worker.index),
                        [&](const Worker& before) {
                          return (may_take >> before.index & 1) != 0 &&
                                 before.waits_until <= release;
                        });
  });
}

// The worker waits for a release at this time; kNever: for none.
void Workers::set_wait(Worker& worker, TimePoint until) noexcept {
  worker.waits_until = until;
  first_wait_ = kNever;
  for (const Worker& each : all_) first_wait_ = std::min(first_wait_, each.waits_until);
}

// The release for which the worker has to wake up: the first one, unless another worker waits for
// it. That worker may then be busy for long, and should not have to wake this one first: so a
// second one waits for the release after it.
TimePoint Workers::release_to_wait_for(const Worker& worker) const noexcept {
  if (are_apart_.load()) return own_release(worker);
  const TimePoint first = ready_.next_release();
  if (first < first_wait_) return first;
  const auto waiting = std::count_if(all_.begin(), all_.end(),
                                     [](const Worker& each) { return each.waits_until != kNever; });
  const bool are_parallel = lock_.is_shared() && (searcher_.is_called_by != nullptr ||
                                                  options_.clock->as_manual() == nullptr);
  return waiting == 1 && are_parallel ? ready_.timers().release_beside_first() : kNever;
}

// How long the worker searches before it sleeps. A pool has one searcher at a time, and only of the
// highest urgency, because no sleeper is woken while it searches. While others work it searches
// even if `spin` is 0: that saves them the system call to wake it for what they leave over.
Nanoseconds Workers::patience_of(const Worker& worker, const Expected& expected) const noexcept {
  if (!may_search(worker)) return Nanoseconds::zero();
  const TimePoint release = ready_.next_release();
  if (options_.early_wake != Nanoseconds::zero() && release < first_wait_ &&
      release <= later(ready_.timers().now(), options_.early_wake)) {
    return Nanoseconds::max();
  }
  // There a thread that yields would have to work to do so: it sleeps at once.
  if (searcher_.is_called_by != nullptr && yields_) [[unlikely]]
    return Nanoseconds::zero();
  return expected.others_work ? std::max(options_.spin, kPoolSearch) : options_.spin;
}

// Polls for whatever would wake a sleeper, until the time `until`, or until nothing was announced
// for as long as `patience`. Returns true if there may be something to run.
bool Workers::search(Worker& worker, TimePoint until, Nanoseconds patience,
                     const Expected& expected) noexcept {
  // Not if it must be on its CPU at a release (`early_wake`), or always (`spin: always`).
  const bool yields = yields_ && patience != Nanoseconds::max();
  const Nanoseconds between_looks = lock_.is_shared() ? kMoment : Nanoseconds::zero();
  set_wait(worker, until);
  ManualWaitBackend* const caller = searcher_.is_called_by;
  const int most_moments = expected.others_work && caller == nullptr ? kMomentsInARow : 0;
  searcher_.index.store(worker.index, std::memory_order_relaxed);
  if (lock_.is_shared() || caller != nullptr) searcher_.state.store(Search::quiet);
  lock_.unlock();
  const Clock& clock = *options_.clock;
  const TimePoint start = clock.now();
  TimePoint now = start, last = start;
  bool has_found = false;
  int moments = 0;  // that announcements have begun in a row
  do {
    if (caller != nullptr) [[unlikely]] {
      if (!must_look(worker, expected))
        caller->search(worker.index, std::min(until, later(last, patience)));
      now = clock.now();
    } else {
      const TimePoint look = later(now, between_looks);
      do {
        spin_pause();
        now = clock.now();
      } while (now < look);
      if (yields) sched_yield();
      has_found = places_.watch_file_descriptors() && places_.look();
    }
    Search asked = Search::asked;
    if (searcher_.state.load(std::memory_order_relaxed) == asked &&  // else its line stays shared
        searcher_.state.compare_exchange_strong(asked, Search::quiet)) {
      last = now;
      if (++moments <= most_moments) continue;
    }
    moments = 0;
    has_found |= must_look(worker, expected) || searcher_.state.load() == Search::called;
  } while (!has_found && now < until && now - last < patience);
  lock_.lock();
  if ((lock_.is_shared() || caller != nullptr) &&
      searcher_.state.exchange(Search::none) != Search::quiet) {
    has_found = true;
  }
  set_wait(worker, kNever);
  worker.spin_time += now - start;
  ready_.timers().read_clock();
  return has_found || now >= until;
}

bool Workers::wait(Worker& worker, TimePoint limit, const FutureState* future) noexcept {
  const Expected expected{
      future, ready_.timers().timers_are_held(),  // before it reads the releases
      lock_.is_shared() && !are_apart_.load() && places_.sleepers_of(0).idle() + 1 < working_};
  const Nanoseconds patience = patience_of(worker, expected);
  if (patience != Nanoseconds::zero() &&
      search(worker, std::min(limit, ready_.next_release()), patience, expected)) {
    return ready_.timers().now() < limit || must_look(worker, expected);
  }
  const TimePoint release = release_to_wait_for(worker);
  TimePoint end = std::min(limit, release);
  if (end == release && end != kNever && may_search(worker)) {
    // Unless that is over: then another worker waits for a release before, and searches.
    const TimePoint early = end - options_.early_wake;
    if (early > ready_.timers().now()) end = early;
  }
  if (end != kNever) wake_up_on_time();
  set_wait(worker, release);
  if (are_apart_.load()) [[unlikely]]
    pass_on_to_each();  // wakes those that must not rely on this one
  Sleepers& sleepers = places_.sleepers_of(worker.index);
  sleepers.begin();
  const bool is_needed = must_look(worker, expected);
  lock_.unlock();
  if (const Tracepoints* const points = tracepoints()) [[unlikely]] {
    points->rclcpp_executor_wait_for_work(end == kNever ? -1
                                                        : (end - ready_.timers().now()).count());
  }
  sleepers.end(!is_needed && places_.backend_of(worker.index).wait(worker.index, end));
  if (const Tracepoints* const points = tracepoints()) [[unlikely]]
    points->rclcpp_executor_get_next_ready();
  lock_.lock();
  set_wait(worker, kNever);
  ready_.timers().read_clock();
  return is_needed || ready_.timers().now() < limit;
}

}  // namespace takt::detail
