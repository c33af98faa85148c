// The executor interface: runs callbacks on threads. The method names are those of rclcpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_EXECUTOR_HPP_
#define TAKT_EXECUTORS_EXECUTOR_HPP_

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/future.hpp"
#include "takt/base/histogram.hpp"
#include "takt/base/own_key.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/base/registry.hpp"
#include "takt/base/version.hpp"
#include "takt/base/visibility.hpp"
#include "takt/executors/rule.hpp"
#include "takt/executors/trace_ring.hpp"
#include "takt/executors/workers_policy.hpp"
#include "takt/nodes/node.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_PUBLIC takt {

class ExecutionModel;
class LatencySlices;
class Watchdog;

/// What an executor records of every callback. Where it is not `full`, the executor does not read
/// the clock after each callback, but about every 2 µs: if brief callbacks suddenly become long, a
/// due timer may wait for up to 16 of them instead of one.
enum class StatisticsLevel {
  off,    // nothing
  count,  // how often each ran
  full,   // also times: a clock reading for each message and two for each callback
};

/// When announced callbacks reach the scheduler.
enum class Readiness {
  wait_set,  // all at once, at a polling point: when the last snapshot has been handed out
  events,    // at every dispatch
};

struct ExecutorOptions;

/// Properties of an executor that are known by its name. The registration states them, and the
/// constructor gets them. The defaults are those of rclcpp's single-threaded executor. An executor
/// of Takt's engine is readiness × order (the scheduler) × rule × workers' policy × threads.
struct ExecutorTraits {
  Readiness readiness = Readiness::wait_set;
  std::string scheduler = "ros";  // unless the options name one
  std::size_t max_threads = 1;    // how many of ExecutorOptions::threads it can use
  bool pool = false;              // without thread options: as many threads as CPUs, at least two
  bool frozen = false;            // nothing is added or removed after the first spin
  bool triggered = false;         // takes a trigger, and a period
  bool isolates = false;          // a thread for each node or group: ExecutorOptions::per
  bool takes_band = false;        // its threads are a band of priorities, the lowest first
  bool simulated = false;  // for a class of its own: `takt simulate` can have it, as all of its
                           // threads belong to executors of the engine
  /// Makes its rule; nullptr: each callback is served. Throws Error.
  std::unique_ptr<Rule> (*rule)(const ExecutorOptions&) = nullptr;
  /// Makes its workers' policy; nullptr: any worker takes each callback. Throws Error.
  std::unique_ptr<WorkersPolicy> (*workers)(const ExecutorOptions&) = nullptr;
  std::vector<OwnKey> keys = {};  // its own keys in the file: ExecutorOptions::own
};

/// For ExecutorTraits: `.rule = takt::make_rule<Mine>`, whose constructor takes ExecutorOptions.
template <class R>
std::unique_ptr<Rule> make_rule(const ExecutorOptions& options) {
  return std::make_unique<R>(options);
}
/// The same: `.workers = takt::make_workers_policy<Mine>`.
template <class P>
std::unique_ptr<WorkersPolicy> make_workers_policy(const ExecutorOptions& options) {
  return std::make_unique<P>(options);
}

/// The unit that gets its own executor and thread in an executor that isolates.
enum class Isolation { node, group };

// Limit: threads of a reentrant group, `reentrant_threads`. At it: more are refused. Seen: the
// error.
inline constexpr std::size_t kMostReentrantThreads = 64;

// Limit: messages that wait for the end of a period of `triggered`, unless the code gives another
// number. At it: further ones are dropped, and counted. Seen: a note of the result.
inline constexpr std::size_t kMostOutputs = 256;

/// When `triggered` runs all that is ready.
struct TriggerOptions {
  enum class Kind { any, all, one };
  Kind kind = Kind::any;
  std::string one;  // Kind::one: this callback, "node/callback"
  /// Instead of `kind`. Called on the executor's thread whenever something new has arrived; must
  /// not block, allocate or throw.
  std::function<bool(std::span<const TriggerInput>)> own;
  /// Logical execution time: at the end of every period the trigger is evaluated, inputs are taken
  /// together, callbacks run, and what they publish is sent together at the end of the next period.
  /// 0: evaluated whenever something arrives.
  Nanoseconds let_period{0};
  /// How many messages can wait for the end of a period; more are dropped and counted.
  std::size_t most_outputs = kMostOutputs;
};

// Limit: `spin` and `early_wake`, without `spin: always`. At it: a longer one is refused. Seen: the
// error.
inline constexpr Nanoseconds kMostSpin = std::chrono::milliseconds(1);
inline constexpr Nanoseconds kSpinAlways = Nanoseconds::max();

/// Options of an executor. An empty field selects the executor's default.
struct ExecutorOptions {
  std::string name = "executor";  // the name of its threads, unless they have their own
  std::string scheduler;          // a registered name; empty: the executor's own order
  /// How its threads sleep: a registered wait back end, or "auto". The first spin resolves "auto"
  /// for good: to `epoll` if there are file descriptors by then, else to `futex`.
  std::string wait = "auto";
  /// One entry per thread. The first is applied to the thread that calls spin.
  /// Empty: the caller's thread as it is; a pool has as many threads as the machine has CPUs.
  std::vector<ThreadAttributes> threads;
  Isolation per = Isolation::node;  // of executors that isolate
  /// With Isolation::group: how many threads each reentrant group has. At most
  /// kMostReentrantThreads.
  std::size_t reentrant_threads = 1;
  TriggerOptions trigger;      // of triggered executors
  OwnValues own;               // of the keys that its traits name
  bool limits_chains = false;  // pools: some chain has ChainOptions::concurrency; they heed it
                               // unless their type has a rule of its own
  OwnValues scheduler_own;     // of the keys that its scheduler's traits name
  /// Callbacks, as "node/callback", that come first in the order of registration, as listed. Used
  /// by the schedulers `listed` and, inside a kind, `ros`.
  std::vector<std::string> order;
  /// A thread that finds nothing looks for arrivals for this long before it sleeps: what comes
  /// meanwhile has no wake-up latency, at the cost of this CPU time per sleep. At most kMostSpin,
  /// or kSpinAlways: it never sleeps, which needs a CPU of its own. In a pool one thread at a time
  /// does so. Under a manual clock without virtual CPUs it takes no time.
  Nanoseconds spin{0};
  /// Wake-up slack for timers: a thread that sleeps until a release wakes up this much earlier, and
  /// spins until then. At most kMostSpin.
  Nanoseconds early_wake{0};
  Realtime realtime = Realtime::prefer;
  StatisticsLevel statistics = StatisticsLevel::full;
  /// How many of its last executions each thread records for a timeline; 0: none. Each then costs
  /// two system calls more, which read the thread's CPU time.
  std::size_t trace_events = 0;
  /// Also counts the latencies of messages there, at the level `full`; executors may share it.
  std::shared_ptr<LatencySlices> slices;
  /// Reports missed deadlines when they are missed; without it, they are reported when callbacks
  /// return.
  std::shared_ptr<Watchdog> watchdog;
  Clock* clock = &Clock::steady();
  /// Runs callbacks instead of their own code, in a simulation. It outlives the executor.
  ExecutionModel* execution_model = nullptr;
};

// The meaning of the figures below, and how two of each are merged: executors/figures.hpp.

/// What an executor counts of one callback. The first executor of a callback counts the messages
/// that were sent before, too.
struct CallbackCounts {
  std::uint64_t received = 0, expected = 0, from_outside = 0, dropped = 0, dropped_by_mode = 0;
  std::optional<std::uint64_t> late, too_late;  // nullopt: no publisher's period is known
  std::uint64_t deadline_misses = 0, overruns = 0, skipped = 0;
  std::optional<std::uint64_t> allocations;  // nullopt: the program does not count them
};

/// What an executor measures of each message or release, at the level `full`.
struct CallbackTimes {
  Histogram latency;    // published (before encoding), or due → the callback starts
  Histogram execution;  // the callback alone
};

/// The parts of a message's latency = waiting + take; of subscriptions, services and clients.
struct MessageTimes {
  Histogram waiting;  // published → a thread picks the callback
  Histogram take;     // picked → the callback starts: the message is taken and decoded
};

constexpr bool has_message_times(EntityKind kind) noexcept {
  return kind != EntityKind::timer && kind != EntityKind::waitable;
}

/// A callback, and all that was counted of it.
struct CountedCallback : CallbackCounts {
  std::string node, group, callback, topic;
  EntityKind kind = EntityKind::waitable;
  /// Messages that were sent to this callback, but neither received nor counted as dropped.
  /// Anything but 0 is a defect.
  std::uint64_t lost() const noexcept {
    const std::uint64_t served = received + dropped + dropped_by_mode;
    return kind != EntityKind::subscription || served > expected ? 0 : expected - served;
  }
};

/// The recorded statistics of one callback.
struct CallbackStatistics : CountedCallback, CallbackTimes, MessageTimes {};

/// One execution, for a reader that does not know the executor's callbacks.
struct NamedTraceEvent : TraceEvent {
  std::string name;  // "/node/callback"
  EntityKind kind = EntityKind::waitable;
  std::uint64_t cause = 0;  // the path of the execution that published its message; 0: none
};

/// What one thread of an executor requested, got and used, from spin to the end of spin.
struct ThreadStatistics {
  ThreadAttributes asked;
  ThreadState in_force;
  ThreadCounters counters;
  Nanoseconds cpu_time{0}, wall_time{0};
  Nanoseconds spin_time{0};
  std::uint64_t missed_periods = 0, dropped_outputs = 0;
  std::vector<NamedTraceEvent> trace;
  std::size_t trace_overwritten = 0;

  /// In percent of one CPU.
  double cpu_percent() const noexcept { return percent(cpu_time); }
  double spin_percent() const noexcept { return percent(spin_time); }

 private:
  double percent(Nanoseconds time) const noexcept {
    return wall_time == Nanoseconds::zero()
               ? 0
               : 100.0 * static_cast<double>(time.count()) / static_cast<double>(wall_time.count());
  }
};

enum class FutureReturnCode { SUCCESS, INTERRUPTED, TIMEOUT };

/// A callback that threw.
struct FailedCallback {
  std::string_view node, callback;  // "/node", "callback"
  std::exception_ptr exception;
};

/// Called on the thread of the callback, as a part of it. True: the executor continues; false:
/// the exception leaves spin. Must not throw.
using ExceptionHandler = std::function<bool(const FailedCallback&)>;

/// Runs the callbacks of the nodes and groups that were added to it.
///
/// Guarantees of every executor:
/// - Callbacks of a mutually exclusive group never run at the same time.
/// - Callbacks that are added while it spins run without delay. Removed callbacks do not run after
///   remove has returned; remove waits for a running callback, except in that very callback, where
///   the removal is complete when the callback returns. Dropping a handle does the same. If
///   callbacks remove each other, in a cycle of any length, the last one to begin its removal does
///   not wait: otherwise none could return. So the callback that does not wait must not
///   free what the removed one uses.
/// - If a callback gives its own group to another executor, the group may run there before that
///   callback has returned.
/// - `cancel` is sticky: it ends the current spin, or else the next one.
/// - An exception from a callback leaves spin on the thread that called it, when all threads of the
///   executor have stopped; or it goes to the handler, which decides.
///
/// Thread safety: every method from any thread, from callbacks too; only one spin at a time
/// (a second one throws Error). Destroy it when it does not spin.
/// Real-time: after the start of spin, Takt's code on the executor's threads allocates nothing and
/// holds no lock without priority inheritance. It polls in two cases only: for `spin` and
/// `early_wake`, and in an executor of several workers, where one that finds nothing searches while
/// others are at work, and for 20 µs after the last announcement
/// (docs/explanation/decisions/0030_one_worker_searches.md). An idle executor sleeps. Adding and
/// removing prepare everything on the calling thread and hand it over at a dispatch point.
class Executor {
 public:
  using SharedPtr = std::shared_ptr<Executor>;

  virtual ~Executor() = default;
  Executor() = default;
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// Adds the node's groups, including later ones, except groups that were created with
  /// automatically_add_to_executor = false. Throws Error when it belongs to an executor already.
  virtual void add_node(const std::shared_ptr<Node>& node) = 0;
  virtual void remove_node(const std::shared_ptr<Node>& node) = 0;
  /// Adds one group of the node. Throws Error when the group belongs to an executor already.
  virtual void add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                  const std::shared_ptr<Node>& node) = 0;
  virtual void remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                     const std::shared_ptr<Node>& node) = 0;

  /// Runs callbacks until cancelled.
  void spin() { spin({}); }
  virtual void spin(const ExceptionHandler& handler) = 0;
  /// Runs one callback. Waits for it until the timeout (negative: no limit).
  virtual void spin_once(Nanoseconds timeout = Nanoseconds(-1)) = 0;
  /// Runs the callbacks that are ready at the call, and does not wait: with a wait set one
  /// snapshot, with events everything that has arrived. Starts no callback after max_duration (0:
  /// no limit).
  virtual void spin_some(Nanoseconds max_duration = Nanoseconds::zero()) = 0;
  /// Runs until nothing is ready, or until max_duration (0: no limit).
  virtual void spin_all(Nanoseconds max_duration = Nanoseconds::zero()) = 0;
  /// Runs callbacks until the future is ready, which wakes the executor from any thread.
  template <class T>
  FutureReturnCode spin_until_future_complete(const Future<T>& future,
                                              Nanoseconds timeout = Nanoseconds(-1)) {
    return spin_until_complete(future.state(), timeout);
  }

  virtual void cancel() noexcept = 0;
  /// True from when all threads of a spin have started until it ends, even after cancel.
  virtual bool is_spinning() const noexcept = 0;

  /// False: due timers are held until true. Used at the beginning and end of a run: all threads
  /// have started before the first release, and no message is lost after the last.
  virtual void release_timers(bool released) noexcept = 0;
  /// Number of callbacks that are ready or running.
  virtual std::size_t pending() const noexcept = 0;

  /// May be called at any time. During a spin the result is a copy that costs the executor's
  /// threads nothing: each figure is true, and figures of one row may differ by the executions
  /// under way.
  virtual std::vector<CallbackStatistics> statistics() const = 0;
  /// The threads of the last spin. Throws Error while it spins.
  virtual std::vector<ThreadStatistics> thread_statistics() const = 0;
  /// How many threads spin has, the caller's included: a manual clock needs as many participants.
  virtual std::size_t thread_count() const { return 1; }
  /// The kernel's numbers of the threads that run its callbacks now, in spin.
  virtual std::vector<int> running_threads() const { return {}; }

  /// From now on each thread records its last executions, as many as `events`, also while it spins.
  /// Allocates on the calling thread. Throws Error if the executor cannot be traced, or has
  /// `trace_events` for all of its time.
  virtual void begin_trace(std::size_t events);
  virtual void end_trace() noexcept {}
  /// The executions recorded since the last begin_trace, also while it spins: of each thread, with
  /// its name, its attributes and the kernel's number.
  virtual std::vector<ThreadStatistics> traces() const { return {}; }

 protected:
  virtual FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) = 0;
};

using ExecutorRegistry = Registry<Executor, ExecutorTraits, const ExecutorOptions&>;
extern template class Registry<Executor, ExecutorTraits, const ExecutorOptions&>;
/// All executors of this process by name.
ExecutorRegistry& executors();

/// Adds the executor to `executors()`; while load_executor() loads a library, only notes it for
/// that call. Always true. Throws Error when the name is taken.
bool register_executor(std::string name, ExecutorRegistry::Entry entry, const char* version);

/// The same for an executor that is the engine with these traits. For the macro below.
bool register_executor(std::string name, std::string description, ExecutorTraits traits,
                       const char* version);

/// At namespace scope in a .cpp file: makes an executor of Takt's engine known as `name`. Its
/// traits follow the description: `.readiness = Readiness::events`.
#define TAKT_REGISTER_EXECUTOR(name, description, ...)                           \
  namespace {                                                                    \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_executor_) =                      \
      ::takt::register_executor(name, description, {__VA_ARGS__}, TAKT_VERSION); \
  }

/// The same for a class of one's own, which implements Executor. Its constructor takes
/// ExecutorOptions and ExecutorTraits.
#define TAKT_REGISTER_EXECUTOR_CLASS(name, description, Class, ...)                      \
  namespace {                                                                            \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_executor_) = ::takt::register_executor(   \
      name,                                                                              \
      {description,                                                                      \
       [](const ::takt::ExecutorOptions& options) -> std::unique_ptr<::takt::Executor> { \
         return std::make_unique<Class>(options, ::takt::ExecutorTraits{__VA_ARGS__});   \
       },                                                                                \
       {__VA_ARGS__}},                                                                   \
      TAKT_VERSION);                                                                     \
  }

/// Loads the library, and adds the executor that it registers under this name to executors(). Its
/// other registrations need calls of their own: load_scheduler() for its schedulers, which also
/// says how a library is found. The executor is not tested here: the conformance suite does that.
/// Throws Error, and adds nothing, if the library cannot be loaded, does not register the name or
/// registers it twice, if the name is taken, or if nobody has registered the scheduler of its
/// traits.
/// Thread safety: may be called from any thread.
/// Real-time: no.
void load_executor(const std::string& name, const std::string& library);

}  // namespace takt

#endif  // TAKT_EXECUTORS_EXECUTOR_HPP_
