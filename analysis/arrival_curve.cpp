// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/arrival_curve.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt::analysis {

std::int64_t plus(std::int64_t a, std::int64_t b) noexcept {
  return std::min(a + b, kUnbounded);  // each is at most a quarter of what the type holds
}

std::int64_t times(std::int64_t a, std::int64_t b) noexcept {
  std::int64_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? kUnbounded : std::min(product, kUnbounded);
}

ArrivalCurve ArrivalCurve::periodic(Time period, Time jitter, Time least_distance) {
  if (period <= 0) throw Error("a period must be positive, not " + std::to_string(period));
  ArrivalCurve curve = by_distances({period});
  curve.jitter_ = jitter;
  curve.closest_ = least_distance;
  return curve;
}

ArrivalCurve ArrivalCurve::by_distances(std::vector<Time> distances) {
  if (distances.empty() || distances.back() <= 0 || distances.front() < 0 ||
      !std::is_sorted(distances.begin(), distances.end())) {
    throw Error("distances of 2, 3, … arrivals must not decrease, and end with a positive one");
  }
  ArrivalCurve curve;
  curve.distances_ = std::move(distances);
  return curve;
}

ArrivalCurve ArrivalCurve::unknown() {
  return by_distances({1}).with_jitter(kUnbounded);
}

ArrivalCurve ArrivalCurve::with_jitter(Time jitter) const {
  ArrivalCurve result = *this;
  result.jitter_ = plus(jitter_, jitter);
  // What keeps its distance at the beginning need not do so at the end.
  if (jitter > 0) result.closest_ = 0;
  return result;
}

ArrivalCurve ArrivalCurve::with_least_distance(Time distance) const {
  ArrivalCurve result = *this;
  result.closest_ = std::max(closest_, distance);
  return result;
}

// Whole rounds of the distances, and what is left.
Time ArrivalCurve::without_jitter(Count count) const noexcept {
  if (count < 2) return 0;
  const Count round = static_cast<Count>(distances_.size());
  const Count rest = (count - 1) % round;
  const Time rounds = times((count - 1) / round, distances_.back());
  return rest == 0 ? rounds : plus(rounds, distances_[static_cast<std::size_t>(rest - 1)]);
}

Time ArrivalCurve::least_distance(Count count) const noexcept {
  if (count < 2) return 0;
  return std::max({Time{0}, without_jitter(count) - jitter_, times(count - 1, closest_)});
}

Count ArrivalCurve::most(Time window) const noexcept {
  if (window <= 0) return 0;
  const Time reach = plus(window, jitter_);
  if (reach >= kUnbounded) return kUnbounded;
  const Count round = static_cast<Count>(distances_.size());
  const Count rounds = (reach - 1) / distances_.back();
  const Time rest = reach - rounds * distances_.back();
  const auto further = std::lower_bound(distances_.begin(), distances_.end(), rest);
  Count result = plus(times(rounds, round), 1 + (further - distances_.begin()));
  if (closest_ > 0) result = std::min(result, (window - 1) / closest_ + 1);
  return result;
}

std::vector<Time> ArrivalCurve::steps(Time limit, Time from, Count most_counts) const {
  if (jitter_ >= kUnbounded) return {0};
  std::vector<Time> result;
  // From the first arrival after those that have come by then, from one instant to the next: with a
  // long jitter, billions come at the first.
  for (Count count = most(from) + 1; count < kUnbounded;) {
    const Time step = least_distance(count);
    if (step >= limit) break;
    if (static_cast<Count>(result.size()) == most_counts) {
      throw Error(fmt::format("more than {} arrivals in a busy window", most_counts),
                  "give times of like size: longer periods, shorter jitter and executions");
    }
    result.push_back(step);
    count = plus(std::max(count, most(plus(step, 1))), 1);
  }
  return result;
}

}  // namespace takt::analysis
