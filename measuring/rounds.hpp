// Combines the rounds of a measurement.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_ROUNDS_HPP_
#define TAKT_MEASURING_ROUNDS_HPP_

#include <string>
#include <utility>
#include <vector>

#include "takt/base/histogram.hpp"

namespace takt::rt {

/// A duration in µs, for tables and files.
inline double us(Nanoseconds duration) {
  return static_cast<double>(duration.count()) / 1e3;
}

/// The value that this fraction of them is not above, between two of them in proportion; 0 without
/// values.
double quantile(std::vector<double> values, double fraction);
inline double median(std::vector<double> values) {
  return quantile(std::move(values), 0.5);
}

/// A median with its 95 % confidence interval.
struct Interval {
  double median = 0, low = 0, high = 0;
};
/// How many times as large the first of each pair is. The pairs are measurements that alternated,
/// so a slow minute of the machine falls on both. The interval is a percentile bootstrap (Efron,
/// 1979) of the median with a fixed seed: the same values always give the same interval. Throws
/// Error without values, or if the numbers of values differ.
Interval paired_ratio(const std::vector<double>& values, const std::vector<double>& to);

/// Latencies of one row. Its rounds alternate with those of other rows.
struct Rounds {
  Histogram all;
  std::vector<double> p50_us, p99_us;  // of each round

  void add(const Histogram& round);
  /// The medians of the rounds.
  double p50() const { return median(p50_us); }
  double p99() const { return median(p99_us); }
  /// The columns of a table.
  std::vector<std::pair<std::string, double>> values() const;
};

}  // namespace takt::rt

#endif  // TAKT_MEASURING_ROUNDS_HPP_
