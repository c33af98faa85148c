// How often something can happen: arrival curves over integers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_ARRIVAL_CURVE_HPP_
#define TAKT_ANALYSIS_ARRIVAL_CURVE_HPP_

#include <cstdint>
#include <span>
#include <vector>

#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_PUBLIC analysis {

/// Nanoseconds, or any other unit of whole numbers: the analyses only add and compare.
using Time = std::int64_t;
using Count = std::int64_t;

/// No bound is known. Everything that is added to it, or is larger, is unbounded, too.
inline constexpr std::int64_t kUnbounded = INT64_MAX / 4;

std::int64_t plus(std::int64_t a, std::int64_t b) noexcept;
std::int64_t times(std::int64_t a, std::int64_t b) noexcept;

/// Most arrivals in any half-open window of a length, by the least distances between them.
/// Source: Le Boudec, Thiran: "Network Calculus", 2001; Richter: "Compositional Scheduling Analysis
/// Using Standard Event Models", 2005, for period, jitter and least distance.
/// Thread safety: as a value. Real-time: no, it allocates.
class ArrivalCurve {
 public:
  /// Every `period`, each up to `jitter` late, no two closer than `least_distance`.
  static ArrivalCurve periodic(Time period, Time jitter = 0, Time least_distance = 0);
  /// By the least distance of the first of 2, 3, … arrivals in a row from the last of them. Further
  /// ones follow from these, as distances add up. Throws Error unless they are positive at the end,
  /// and none is less than the one before.
  static ArrivalCurve by_distances(std::vector<Time> distances);

  /// Any number at any time.
  static ArrivalCurve unknown();

  /// The same after something that delays each by up to `jitter` more than the least.
  ArrivalCurve with_jitter(Time jitter) const;
  /// The same where, in addition, no two are closer.
  ArrivalCurve with_least_distance(Time distance) const;

  /// η(window): most arrivals in [t, t + window). 0 for an empty one.
  Count most(Time window) const noexcept;
  /// δ⁻(count): least time from the first to the last of so many.
  Time least_distance(Count count) const noexcept;
  /// The instants at which the most critical sequence of arrivals has one more, from `from` to
  /// below `limit`. Throws Error when these are more than `most_counts`.
  std::vector<Time> steps(Time limit, Time from = 0, Count most_counts = kUnbounded) const;

  /// What it is made of: least_distance(n) follows from these.
  std::span<const Time> distances() const noexcept { return distances_; }  // without the jitter
  Time jitter() const noexcept { return jitter_; }
  Time closest() const noexcept { return closest_; }

  /// By their numbers, in any order.
  friend auto operator<=>(const ArrivalCurve&, const ArrivalCurve&) = default;

 private:
  Time without_jitter(Count count) const noexcept;

  std::vector<Time> distances_;  // of 2, 3, … arrivals
  Time jitter_ = 0;
  Time closest_ = 0;  // whatever the jitter
};

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_ARRIVAL_CURVE_HPP_
