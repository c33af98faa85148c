// The clocks that other tools' traces go by.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TRACE_CLOCK_HPP_
#define TAKT_BASE_TRACE_CLOCK_HPP_

#include <ctime>
#include <string>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// One of them, by the name that ftrace has for it.
/// Thread safety: every method from any thread. Real-time: no.
class TraceClock {
 public:
  /// "monotonic", that of Clock::steady(), "boottime", "realtime", "mono_raw".
  static std::vector<std::string> names();
  /// Throws Error, which lists the names, if it is none.
  explicit TraceClock(const std::string& name);

  /// What a time of CLOCK_MONOTONIC lacks to be one of this clock, now: other clocks are corrected
  /// otherwise, or jump.
  Nanoseconds offset() const;

 private:
  clockid_t clock_;
};

}  // namespace takt

#endif  // TAKT_BASE_TRACE_CLOCK_HPP_
