// What the analyses know of a system: numbers, without nodes, threads and files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_SYSTEM_HPP_
#define TAKT_ANALYSIS_SYSTEM_HPP_

#include <optional>
#include <string>
#include <vector>

#include "takt/analysis/arrival_curve.hpp"
#include "takt/analysis/supply.hpp"

namespace takt::analysis {

/// Which of the ready callbacks an executor runs next. A scheduler that fits none of these has an
/// arbitrary order, for which there are bounds, too.
enum class Order {
  arbitrary,
  by_urgency,  // the larger Callback::urgency first, then by arrival
  by_arrival,  // messages as they were sent, a timer's release when the executor has looked
  by_point,    // the least of ready time + Callback::point first, then by arrival
  in_windows,  // what was seen at one polling point before what was seen at the next; inside, by
               // Callback::place
  in_turns,    // one callback of each Callback::group in turn; inside, by arrival
};

/// Messages that each execution of a callback sends to another one, at its end.
struct Output {
  std::size_t to = 0;
  Count messages = 1;               // at most
  Time least_delay = 0, delay = 0;  // between processes
};

struct Callback {
  std::string name;
  std::size_t executor = 0;
  Time execution = 0;        // worst case, in processor time
  Time least_execution = 0;  // best case
  /// What makes it ready, beside the outputs of other callbacks: a timer's releases, or messages
  /// from outside the system.
  std::optional<ArrivalCurve> arrivals;
  /// Releases that it has missed are served by one execution.
  bool is_timer = false;
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
  /// One of these places for its threads, or else a processor for each.
  std::optional<Reservation> reservation;
  struct Share {
    int cpu = 0;
    int priority = 0;  // SCHED_FIFO: the more urgent thread preempts
  };
  std::optional<Share> share;
  /// Why nothing can be said about its threads; empty: something can.
  std::string unknown;
};

struct Chain {
  std::string name;
  std::vector<std::size_t> callbacks;  // in order, each reached by an output of the one before
};

struct System {
  std::vector<Executor> executors;
  std::vector<Callback> callbacks;
  std::vector<Chain> chains;
};

}  // namespace takt::analysis

#endif  // TAKT_ANALYSIS_SYSTEM_HPP_
