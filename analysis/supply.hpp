// The processor time that a thread gets at least.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_SUPPLY_HPP_
#define TAKT_ANALYSIS_SUPPLY_HPP_

#include <functional>
#include <utility>

#include "takt/analysis/arrival_curve.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_PUBLIC analysis {

/// The least x ≥ `from` with x ≥ f(x), for a function that never decreases. kUnbounded when it is
/// larger than `limit`, or takes too many steps to find.
template <class Function>
Time least_fixed_point(Function&& f, Time limit, Time from = 1) {
  for (int step = 0; step < 1'000'000; ++step) {
    if (from > limit) return kUnbounded;
    const Time next = f(from);
    if (next <= from) return from;
    from = next;
  }
  return kUnbounded;
}

/// Time on a processor for a budget in each period, as SCHED_DEADLINE grants it.
struct Reservation {
  Time budget, period;
};

/// What one thread gets in any window that begins when nothing of its own and nothing more urgent
/// is pending.
/// Thread safety: as a value. Real-time: no, it allocates.
class Supply {
 public:
  /// What more urgent threads of the same processor want in a window.
  using Demand = std::function<Time(Time window)>;

  /// A processor of its own.
  Supply() = default;
  /// Source: Shin, Lee: "Periodic Resource Model for Compositional Real-Time Guarantees", RTSS
  /// 2003. The deadline is the period: then Linux' rule for a late wake-up takes nothing from it.
  /// `switches`: what it pays of its budget, in a window of any length, as others come and go.
  Supply(Reservation reservation, Demand switches)
      : budget_(reservation.budget), period_(reservation.period), switches_(std::move(switches)) {}
  /// What threads that are more urgent, or as urgent, leave of a processor. Equal ones do not
  /// preempt: while they wait, this one may begin whatever it has.
  Supply(Demand above, bool has_equals) : above_(std::move(above)), has_equals_(has_equals) {}

  /// What Linux takes away from real-time threads, when `is_throttled`: what is left of each period
  /// after the budget that it grants to all of them. See System::may_come_twice.
  void limit(Reservation granted, bool may_come_twice, const bool& is_throttled) {
    granted_ = granted;
    further_ = may_come_twice ? 1 : 0;
    is_throttled_ = &is_throttled;
  }

  bool has_equals() const noexcept { return has_equals_; }
  /// Whether it holds in any window: what more urgent threads have not done yet when a window
  /// begins is in no arrival curve.
  bool holds_in_any_window() const noexcept { return above_ == nullptr; }
  bool is_dedicated() const noexcept {
    return period_ == 0 && above_ == nullptr && !is_throttled();
  }
  /// The least time in the longest window that may have less than `work`. kUnbounded above `limit`.
  /// `at_least`: a time that it is known not to be below, as for less work.
  Time time_for(Time work, Time limit, Time at_least = 0) const;

 private:
  bool is_throttled() const noexcept { return is_throttled_ != nullptr && *is_throttled_; }

  Reservation granted_{0, 1};
  Time further_ = 0;  // periods beside those of a window
  const bool* is_throttled_ = nullptr;
  Time budget_ = 0, period_ = 0;  // no reservation: 0
  Demand switches_;               // of a reservation; nullptr: nothing
  Demand above_;
  bool has_equals_ = false;
};

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_SUPPLY_HPP_
