// What several rounds of one measurement say together.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_ROUNDS_HPP_
#define TAKT_MEASURING_ROUNDS_HPP_

#include <string>
#include <utility>
#include <vector>

#include "takt/base/histogram.hpp"

namespace takt::rt {

/// A duration in µs, as tables and files have it.
inline double us(Nanoseconds duration) {
  return static_cast<double>(duration.count()) / 1e3;
}

double median(std::vector<double> values);

/// A median with its 95 % confidence interval.
struct Interval {
  double median = 0, low = 0, high = 0;
};
/// How many times as large the first of each pair is: the ratios of measurements that alternated,
/// so that a slow minute of the machine falls on both. The interval is a percentile bootstrap
/// (Efron, 1979) of the median with a fixed seed: the same values always give the same interval.
/// Throws Error when there are not as many of each, or none.
Interval paired_ratio(const std::vector<double>& values, const std::vector<double>& to);

/// Latencies of one row over its rounds, which alternate with those of other rows.
struct Rounds {
  Histogram all;
  std::vector<double> p50_us, p99_us;  // of each round

  void add(const Histogram& round);
  /// The medians of the rounds.
  double p50() const { return median(p50_us); }
  double p99() const { return median(p99_us); }
  /// As columns of a table.
  std::vector<std::pair<std::string, double>> values() const;
};

}  // namespace takt::rt

#endif  // TAKT_MEASURING_ROUNDS_HPP_
