// Arrivals that an arrival curve permits, as early as they may come.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_ARRIVALS_HPP_
#define TAKT_CONTAINERS_SIMULATION_ARRIVALS_HPP_

#include <algorithm>
#include <deque>
#include <utility>

#include "takt/analysis/arrival_curve.hpp"
#include "takt/base/time.hpp"

namespace takt {

/// Thread safety: none. Real-time: no.
class Arrivals {
 public:
  Arrivals(analysis::ArrivalCurve curve, TimePoint first)
      : curve_(std::move(curve)), next_(first), due_{without_jitter(first)} {}

  TimePoint next() const noexcept { return next_; }
  /// Takes the next arrival, and computes the one after it.
  void take() {
    TimePoint due = TimePoint::min();
    auto before = due_.begin();
    for (auto distance = curve_.distances().begin(); before != due_.end(); ++before, ++distance)
      due = std::max(due, later(*before, Nanoseconds(*distance)));
    next_ = std::max(due, later(next_, Nanoseconds(curve_.closest())));
    due_.push_front(std::max(due, without_jitter(next_)));
    if (due_.size() > curve_.distances().size()) due_.pop_back();
  }

 private:
  TimePoint without_jitter(TimePoint arrival) const {
    return later(arrival, -Nanoseconds(curve_.jitter()));
  }

  const analysis::ArrivalCurve curve_;
  TimePoint next_;
  // Each arrival comes when it is due, or up to the jitter later. Those that are due keep the
  // distances of the curve, which say nothing of more than these: the last one is the first here.
  std::deque<TimePoint> due_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_ARRIVALS_HPP_
