// Parameters of callbacks: priority, times, and the reaction to overruns.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CALLBACK_GROUPS_CALLBACK_PARAMETERS_HPP_
#define TAKT_CALLBACK_GROUPS_CALLBACK_PARAMETERS_HPP_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/sched/scheduler.hpp"

namespace TAKT_PUBLIC takt {

/// The reaction when a callback misses its deadline, exceeds its budget, or is a timer that still
/// runs at its next release. All overruns are counted.
enum class OverrunPolicy : std::uint8_t {
  catch_up,  // timers: serve one of the missed releases at once (the default)
  skip,      // timers: drop missed releases, and keep the phase
  abort,     // end the chain instance: its messages are not delivered
  demote,    // run after all others until one execution has no overrun
};
/// The words of the configuration file with what they mean.
const std::vector<std::pair<std::string, OverrunPolicy>>& overrun_policies();

/// How a callback is served in a mode: see Container::set_mode.
enum class Serving : std::uint8_t {
  usual,
  demoted,  // after all others, where the order is one of urgencies or deadlines
  dropped,  // what arrives is taken and discarded, also after all others; a timer keeps its phase
};

/// The argument of a handler.
struct OverrunReport {
  std::string_view node, callback;  // valid during the call
  std::uint64_t sequence = 0;       // of the message or release
  TimePoint ready_time{}, deadline = kNever;
  /// When its execution ended; kNever when the watchdog reports it before.
  TimePoint end = kNever;
  Nanoseconds execution_time{0}, budget{0};  // 0: not known, none
};
/// Called by the thread that ran the callback, after it, or by the watchdog at the deadline. Must
/// neither block, nor allocate, nor throw, if the callback must not.
using OverrunHandler = std::function<void(const OverrunReport&)>;

/// Parameters of a group apply to its callbacks; parameters of a callback take precedence. Times
/// and numbers of releases are positive.
struct CallbackParameters {
  std::optional<int> priority;          // larger is more urgent; else 0
  std::optional<Nanoseconds> deadline;  // from release or publication to the end
  std::optional<Nanoseconds> period;    // between two messages at least; a timer has its own
  std::optional<Nanoseconds> budget;    // execution takes so long at most (wall time)
  std::optional<int> criticality;       // larger matters more; else its chain's, or 0
  std::optional<OverrunPolicy> overrun;
  std::optional<int> releases;  // of a timer that may wait; else 1: those that come meanwhile are
                                // missed
  std::optional<Serving> serving;  // else as usual; a container's modes set it
  OverrunHandler on_deadline_miss, on_overrun;

  /// These, completed by those of `others` that are not set here.
  CallbackParameters or_else(const CallbackParameters& others) const;
  /// Throws Error about the first invalid value: times or releases that are not positive, a budget
  /// above deadline or period. `own_period`: of a timer, else 0.
  void check(Nanoseconds own_period = Nanoseconds::zero()) const;
};

}  // namespace takt

#endif  // TAKT_CALLBACK_GROUPS_CALLBACK_PARAMETERS_HPP_
