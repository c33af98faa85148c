// Which clock is the steady one of this process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_STEADY_CLOCK_HPP_
#define TAKT_BASE_STEADY_CLOCK_HPP_

#include "takt/base/clock.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// From here on `Clock::steady()` is this clock, which outlives the process' threads: of a program
/// that is simulated. Call it before anything keeps a clock.
/// Thread safety: from any thread. Real-time: yes.
void replace_steady_clock(Clock& clock) noexcept;

}  // namespace takt

#endif  // TAKT_BASE_STEADY_CLOCK_HPP_
