// The input of the analyses: numbers, without nodes, threads and files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_SYSTEM_HPP_
#define TAKT_ANALYSIS_SYSTEM_HPP_

#include <optional>
#include <string>
#include <vector>

#include "takt/analysis/arrival_curve.hpp"
#include "takt/analysis/order.hpp"
#include "takt/analysis/supply.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_PUBLIC analysis {

/// Messages that each execution of a callback sends to another one, at its end.
struct Output {
  std::size_t to = 0;
  Count messages = 1;               // at most
  Time least_delay = 0, delay = 0;  // between processes
  /// It is an input of a join: all callbacks with such an output to `to` together send one message,
  /// when the last of them has run since the message before. Exactly one of them has `messages`;
  /// any may be chosen, but a bound needs one whose arrivals do not stop for ever.
  bool waits = false;
};

struct Callback {
  std::string name;
  std::size_t executor = 0;
  Time execution = 0;        // worst case, in processor time
  Time least_execution = 0;  // best case
  /// What makes it ready, beside the outputs of other callbacks: a timer's releases, or messages
  /// from outside the system.
  std::optional<ArrivalCurve> arrivals;
  /// The longest time from one of these arrivals to the next.
  Time longest_gap = kUnbounded;
  /// Releases that it has missed are served by one execution.
  bool is_timer = false;
  /// How many messages may wait for it; of more, the oldest are lost. nullopt: any number, but of
  /// a timer's releases one.
  std::optional<Count> depth;
  /// Of what is sent to it some may be lost, so that a join cannot rely on its next execution.
  bool may_lose = false;
  bool has_one_release() const { return is_timer && depth.value_or(1) == 1; }
  std::vector<Output> outputs;
  // What orders it, see Order.
  std::int64_t urgency = 0;
  Time point = 0;  // kUnbounded: after all that have one
  std::size_t place = 0, group = 0;
};

struct Executor {
  std::string name;
  Order order = Order::arbitrary;
  /// Callbacks become ready at polling points; otherwise at once.
  bool is_wait_set = false;
  std::size_t threads = 1;
  /// Its callbacks interrupt each other, up to so many at a time, on one CPU. 0: they do not.
  std::size_t levels = 0;
  /// Logical execution time: at the end of every such period it takes one input of each callback,
  /// runs these, and sends what they publish at the end of the next. 0: it does not.
  Time let_period = 0;
  Time sending = 0;  // what its callbacks send then takes so long; a part of their executions
  /// One of these places for its threads, or else a processor for each, of which nobody takes a
  /// part. Linux keeps all reservations together, by EDF on all CPUs: so each preempts all others.
  std::optional<Reservation> reservation;
  struct Share {
    std::vector<int> cpus;  // on which it may run, sorted
    int priority = 0;       // SCHED_FIFO: the more urgent thread preempts
    Time slice = 0;         // SCHED_RR: after so long it goes behind others of its priority
    bool meets(const Share& other) const;
    /// Whether it may wait while the other one runs.
    bool yields_to(const Share& other) const { return meets(other) && other.priority >= priority; }
  };
  std::optional<Share> share;
  /// Other executors that may take the CPU that one of its threads runs on, though there is another
  /// one for it: each of their executions costs it two context switches.
  std::vector<std::size_t> movers;
  /// What a thread that shares its CPU needs there besides its callbacks: before each release of a
  /// timer, and after the last callback before it sleeps. kUnbounded: it never sleeps.
  Time early_wake = 0, spin = 0;
  /// A dispatch takes so much longer than that of System::overheads: its CPU is slower.
  Time more_dispatch = 0;
  bool is_realtime = false;  // see System::for_realtime
  /// Why nothing can be said about its threads; empty: something can.
  std::string unknown;
};

struct Chain {
  std::string name;
  std::vector<std::size_t> callbacks;  // in order, each reached by an output of the one before
};

/// A part of a bound, for people: all together make the bound.
struct Term {
  std::string what;
  Time time = 0;
};

/// The time that the machine adds to the callbacks' own time.
struct Overheads {
  Time dispatch = 0;        // to each execution
  Time wake = 0;            // until a thread that sleeps runs
  Time context_switch = 0;  // from one thread of a CPU to another
};

struct System {
  std::vector<Executor> executors;
  std::vector<Callback> callbacks;
  std::vector<Chain> chains;
  Overheads overheads{};
  /// What Linux grants to the real-time threads of each CPU, in each period; if not given, all.
  /// SCHED_DEADLINE is not meant.
  std::optional<Reservation> for_realtime;
  /// What it takes may come at the end of a period, and at once again: Linux' fair server.
  bool may_come_twice = false;
};

/// The executors whose threads may run while that of this one waits: those that preempt it, if they
/// are as many as its CPUs. Thread safety: a pure function. Real-time: no.
std::vector<std::size_t> rivals(const System& system, std::size_t executor);

/// Those that cost the threads of this one nothing but switches: they send others, which may move,
/// to its CPUs. Thread safety: a pure function. Real-time: no.
std::vector<std::size_t> pushers(const System& system, std::size_t executor);

/// Throws Error for what would make the analyses divide by zero, read outside, or answer a question
/// that is none.
/// Thread safety: a pure function. Real-time: no.
void check(const System& system);

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_SYSTEM_HPP_
