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

double median(std::vector<double> values);

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
