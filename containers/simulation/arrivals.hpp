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
      : curve_(std::move(curve)), next_(first) {}

  TimePoint next() const noexcept { return next_; }
  /// Takes the next arrival, and computes the one after it.
  void take() {
    past_.push_back(next_);
    if (past_.size() > kMostPast) past_.pop_front();
    TimePoint next = past_.back();
    analysis::Count count = 2;
    for (auto before = past_.rbegin(); before != past_.rend(); ++before, ++count)
      next = std::max(next, later(*before, Nanoseconds(curve_.least_distance(count))));
    if (past_.size() == kMostPast) next = std::max(next, later(past_.back(), mean()));
    next_ = next;
  }

 private:
  // Limit: past arrivals that say when the next one of a simulation may come. At it: it comes later
  // than it might, if more may come at once. Seen: nothing.
  static constexpr std::size_t kMostPast = 1024;

  // The mean distance that the curve permits in the long run.
  Nanoseconds mean() const { return Nanoseconds(curve_.least_distance(kMostPast + 1) / kMostPast); }

  const analysis::ArrivalCurve curve_;
  TimePoint next_;
  std::deque<TimePoint> past_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_ARRIVALS_HPP_
