// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/callback_observer.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/held_locks.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/logger.hpp"
#include "takt/entities/traced.hpp"
#include "takt/executors/engine/observed.hpp"
#include "takt/executors/past_statistics.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/nodes/callback_info.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"
#include "takt/sched/threads/memory_lock.hpp"

namespace takt {

using detail::Supervision;

class CallbackObserver::Callback : public detail::Observed {
 public:
  using Observed::Observed;
  std::atomic<int> running{0};
};

struct CallbackObserver::State final : private Watchdog::Watched {
  State(const ExecutorOptions& of, std::size_t threads)
      : options(of),
        running(std::max<std::size_t>(of.threads.empty() ? threads : of.threads.size(), 1)),
        rings(running.size()),
        is_traced(of.trace_events != 0) {
    if (options.watchdog != nullptr) options.watchdog->add(*this);
  }
  ~State() {
    if (options.watchdog != nullptr) options.watchdog->remove(*this);
  }
  /// The trace of the thread with this index.
  ThreadStatistics trace_of(std::size_t index) const {
    ThreadStatistics result;
    for (const TraceEvent& event : rings[index].events()) {
      const auto of = traced.find(event.callback);
      result.trace.push_back(detail::named(event, of != traced.end() ? &of->second : nullptr));
    }
    result.trace_overwritten = rings[index].overwritten();
    return result;
  }
  /// The counter of a taken input that must be discarded; nullptr: it must be executed.
  Counter<>* discarded(Callback& callback, const Slot& slot) {
    const std::lock_guard guard(lock);
    if (callback.is_dropped()) return &callback.dropped_by_mode;
    const bool is_aborted = !callback.is_timer() && AbortedInstances::contains(slot.chain_instance);
    return is_aborted ? &callback.counts.discarded : nullptr;
  }
  bool records_times() const noexcept { return options.statistics == StatisticsLevel::full; }
  CallbackStatistics statistics_of(const Callback& callback, bool has_ended) const {
    Entity::Counts counts = callback.entity_counts(has_ended, has_ended);
    if (callback.entity->kind() == EntityKind::timer && !has_ended) {
      counts.missed += detail::releases_left(*callback.entity, timers_held.load());
    }
    return callback.statistics(counts);
  }

  const ExecutorOptions options;
  std::vector<std::atomic<int>> running;  // the kernel's number of each thread; 0: it does not run
  std::vector<TraceRing> rings;           // of each thread
  detail::DispatchLock lock{true};        // of settings and counts
  std::atomic<TimePoint> timers_held{};
  mutable RankedMutex<LockRank::observer> mutex;  // guards what follows
  std::map<CallbackId, std::unique_ptr<Callback>> callbacks;
  CallbackId next_id = 0;
  bool is_traced;  // whether a trace was ever begun
  std::map<CallbackId, detail::Traced> traced;
  detail::PastStatistics past;
  std::vector<ThreadStatistics> ended;

 private:
  // As Observation::report_miss.
  std::optional<TimePoint> report_miss(TimePoint now) noexcept override {
    Supervision::Miss miss;
    {
      const std::lock_guard guard(mutex);
      for (const auto& [id, callback] : callbacks) {
        if (Supervision::find_miss(callback->supervision, callback->settings.overrun, now, miss))
          break;
      }
    }
    if (miss.late == nullptr) return miss.next;
    Supervision::report(miss);
    return {};
  }
};

CallbackObserver::CallbackObserver(const ExecutorOptions& options, std::size_t threads)
    : state_(std::make_unique<State>(options, threads)) {
}

CallbackObserver::~CallbackObserver() = default;

// ---- Callbacks ----

namespace {

detail::CallbackSettings settings_of(const detail::Observed& callback, const Node& node,
                                     CallbackId id) {
  const CallbackParameters parameters = node.callback_parameters(*callback.entity);
  const CallbackInfo ids{.id = id, .kind = callback.entity->kind(), .registration = id};
  return {.info = callback_info(node, *callback.entity, ids),
          .overrun = parameters.overrun.value_or(OverrunPolicy::catch_up),
          .serving = parameters.serving.value_or(Serving::usual)};
}

}  // namespace

CallbackObserver::Callback& CallbackObserver::add(const std::shared_ptr<Entity>& entity,
                                                  const Node& node) {
  auto callback = std::make_unique<Callback>(entity, node, node.callback_parameters(*entity),
                                             state_->running.size(), state_->records_times());
  {
    const std::lock_guard ownership(ownership_mutex());
    callback->begin_counting();
  }
  const std::lock_guard guard(state_->mutex);
  const CallbackId id = state_->next_id++;
  callback->settings = settings_of(*callback, node, id);
  callback->is_checked = callback->must_be_checked(callback->settings);
  if (state_->is_traced && state_->traced.size() < detail::kMostTraced) {
    state_->traced.emplace(id, *callback);
  }
  return *state_->callbacks.emplace(id, std::move(callback)).first->second;
}

void CallbackObserver::remove(Callback& callback) noexcept {
  callback.end_counting();
  std::unique_ptr<Callback> gone;  // after the lock, as it holds functions of the user
  const std::lock_guard guard(state_->mutex);
  state_->past.add(state_->statistics_of(callback, true));
  const auto found = state_->callbacks.find(callback.id());
  gone = std::move(found->second);
  state_->callbacks.erase(found);
}

void CallbackObserver::parameters_changed(Node& node) {
  const std::lock_guard guard(state_->mutex);
  for (const auto& entity : node.entities()) {
    const auto found =
        std::find_if(state_->callbacks.begin(), state_->callbacks.end(),
                     [&](const auto& each) { return each.second->entity == entity; });
    if (found == state_->callbacks.end()) continue;
    Callback& callback = *found->second;
    const detail::CallbackSettings now = settings_of(callback, node, found->first);
    const std::lock_guard lock(state_->lock);
    callback.settings = now;
    callback.is_checked = callback.must_be_checked(now);
  }
}

Entity& CallbackObserver::entity(const Callback& callback) noexcept {
  return *callback.entity;
}

CallbackInfo CallbackObserver::info(const Callback& callback) const {
  const std::lock_guard lock(state_->lock);
  return callback.settings.info;
}

bool CallbackObserver::is_demoted(const Callback& callback) const {
  const std::lock_guard lock(state_->lock);
  return callback.is_demoted || callback.settings.serving != Serving::usual;
}

// ---- What was counted ----

void CallbackObserver::release_timers(bool released) noexcept {
  state_->timers_held.store(released ? TimePoint{} : state_->options.clock->now());
}

std::size_t CallbackObserver::pending() const noexcept {
  const std::lock_guard guard(state_->mutex);
  return static_cast<std::size_t>(
      std::count_if(state_->callbacks.begin(), state_->callbacks.end(), [](const auto& each) {
        const Callback& callback = *each.second;
        // In this order: see Observation::is_pending.
        return (!callback.is_timer() && callback.entity->ready_count() != 0) ||
               callback.running.load() != 0;
      }));
}

std::vector<CallbackStatistics> CallbackObserver::statistics() const {
  const std::lock_guard guard(state_->mutex);
  std::vector<CallbackStatistics> present;
  present.reserve(state_->callbacks.size());
  for (const auto& [id, callback] : state_->callbacks) {
    present.push_back(state_->statistics_of(*callback, false));
  }
  return state_->past.with(std::move(present));
}

std::vector<ThreadStatistics> CallbackObserver::thread_statistics() const {
  const std::lock_guard guard(state_->mutex);
  return state_->ended;
}

std::vector<int> CallbackObserver::running_threads() const {
  std::vector<int> threads;
  for (const std::atomic<int>& thread : state_->running) {
    if (const int number = thread.load(); number != 0) threads.push_back(number);
  }
  return threads;
}

void CallbackObserver::begin_trace(std::size_t events) {
  detail::check_begin_trace(state_->options);
  const std::lock_guard guard(state_->mutex);
  state_->is_traced = true;
  for (const auto& [id, callback] : state_->callbacks) {
    callback->begin_trace();
    if (state_->traced.size() < detail::kMostTraced) state_->traced.emplace(id, *callback);
  }
  for (TraceRing& ring : state_->rings) ring.begin(events);
}

void CallbackObserver::end_trace() noexcept {
  const std::lock_guard guard(state_->mutex);
  if (state_->options.trace_events != 0) return;
  for (TraceRing& ring : state_->rings) ring.end();
}

std::vector<ThreadStatistics> CallbackObserver::traces() const {
  const std::lock_guard guard(state_->mutex);
  std::vector<ThreadStatistics> result;
  for (std::size_t i = 0; i < state_->rings.size(); ++i) {
    result.push_back(state_->trace_of(i));
    if (const int thread = state_->running[i].load(); thread != 0) {
      result.back().in_force = thread_state(thread);
    } else if (i < state_->ended.size()) {
      result.back().in_force = state_->ended[i].in_force;
    }
  }
  return result;
}

// ---- Threads ----

struct CallbackObserver::Thread::State {
  CallbackObserver::State& observer;
  const std::size_t index;
  ThreadStatistics statistics = {};
  // Last: what is above belongs to the set-up.
  RealtimeScope scope = {};
  Nanoseconds cpu_time = thread_cpu_time();
  TimePoint begin = Clock::steady().now();
  std::uint64_t allocations = allocations_of_this_thread();  // up to the end of its last callback

  void execute(Callback& callback, Slot& slot, TimePoint picked);
};

CallbackObserver::Thread::Thread(CallbackObserver& observer, std::size_t index)
    : state_([&] {
        const ExecutorOptions& options = observer.state_->options;
        const std::size_t threads = observer.state_->running.size();
        if (index >= threads) {
          throw Error(fmt::format("executor '{}' has {} threads, and none of the index {}",
                                  options.name, threads, index),
                      "tell its CallbackObserver how many there are");
        }
        Logger::instance().start();  // not in the first callback that logs
        if (const Tracepoints* const points = tracepoints()) points->thread_begins();
        ThreadStatistics statistics;
        if (options.threads.empty()) {
          statistics.asked.name =
              index == 0 ? options.name : fmt::format("{}-{}", options.name, index);
          statistics.in_force = this_thread_state();
        } else {
          statistics.asked = options.threads.at(index);
          statistics.in_force = apply(statistics.asked, options.realtime);
        }
        if (is_realtime(statistics.in_force.policy)) prefault_stack();
        if (options.trace_events != 0) observer.state_->rings[index].begin(options.trace_events);
        return std::unique_ptr<State>(new State{*observer.state_, index, std::move(statistics)});
      }()) {
  state_->observer.running[index].store(gettid());
}

CallbackObserver::Thread::~Thread() {
  CallbackObserver::State& observer = state_->observer;
  observer.running[state_->index].store(0);
  ThreadStatistics& mine = state_->statistics;
  mine.counters = state_->scope.so_far();
  mine.cpu_time = thread_cpu_time() - state_->cpu_time;
  mine.wall_time = Clock::steady().now() - state_->begin;
  const std::lock_guard guard(observer.mutex);
  if (observer.options.trace_events != 0) {
    ThreadStatistics traced = observer.trace_of(state_->index);
    mine.trace = std::move(traced.trace);
    mine.trace_overwritten = traced.trace_overwritten;
  }
  observer.ended.resize(std::max(observer.ended.size(), state_->index + 1));
  observer.ended[state_->index] = std::move(mine);
}

bool CallbackObserver::Thread::run(Callback& callback) {
  CallbackObserver::State& observer = state_->observer;
  struct Runs {  // before it takes: see pending()
    explicit Runs(Callback& of) : callback(of) { callback.running.fetch_add(1); }
    ~Runs() { callback.running.fetch_sub(1); }
    Callback& callback;
  } const runs(callback);
  const TimePoint picked = observer.options.clock->now();
  Slot slot;
  slot.sequence = next_sequence();
  if (!callback.entity->take(slot)) return false;
  if (Counter<>* const discarded = observer.discarded(callback, slot); discarded == nullptr) {
    state_->execute(callback, slot, picked);
  } else {
    callback.entity->discard(slot);
    const std::lock_guard lock(observer.lock);
    ++*discarded;
  }
  return true;
}

// As Dispatcher::run, which also saves readings of the clock.
void CallbackObserver::Thread::State::execute(Callback& callback, Slot& slot, TimePoint picked) {
  const ExecutorOptions& options = observer.options;
  bool is_checked = false;
  {
    const std::lock_guard lock(observer.lock);
    is_checked = callback.is_checked;
    const TimePoint deadline = callback.deadline_of(slot.ready_time);
    if (is_checked && options.watchdog != nullptr && deadline != kNever) {
      callback.supervision->wait(deadline, *options.watchdog);
    }
    if (is_checked) callback.watch_execution(index, options.watchdog.get());
  }
  std::exception_ptr exception;
  detail::ExecutionTimes times{.picked = std::max(picked, slot.ready_time),
                               .is_traced = observer.rings[index].is_on()};
  {
    Dispatch dispatch = callback.dispatch(slot, &callback.settings.info, nullptr, nullptr);
    const Dispatch::Scope scope_of_callback(dispatch);
    if (is_checked) callback.begin_checked(index, dispatch);
    const detail::ThreadUsage before =
        times.is_traced ? detail::ThreadUsage::now() : detail::ThreadUsage{};
    times.start = std::max(options.clock->now(), times.picked);
    try {
      detail::expect_no_lock("callback");
      const TracedCallback traced(*callback.entity, slot);
      callback.entity->execute(slot);
    } catch (...) {
      exception = std::current_exception();
    }
    times.end = options.clock->now();
    const std::uint64_t all = allocations_of_this_thread();
    times.allocations = all - std::exchange(allocations, all);
    if (times.is_traced) times.used = detail::ThreadUsage::now() - before;
    try {
      if (is_checked) callback.check_limits(observer.lock, index, slot, dispatch, times);
    } catch (...) {
      exception = std::current_exception();
    }
  }
  {
    const std::lock_guard lock(observer.lock);
    if (options.statistics != StatisticsLevel::off) ++callback.counts.executions;
    if (observer.records_times()) callback.record_times(slot, times, options.slices.get());
    if (times.is_traced) callback.trace(observer.rings[index], slot, times);
  }
  if (exception != nullptr) std::rethrow_exception(exception);
}

}  // namespace takt
