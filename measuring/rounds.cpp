// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/rounds.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "takt/base/error.hpp"

namespace takt::rt {

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double place = fraction * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], place - static_cast<double>(below));
}

Interval paired_ratio(const std::vector<double>& values, const std::vector<double>& to) {
  constexpr std::size_t kResamples = 2000, kTail = kResamples / 40;  // 2.5 % on each side
  if (values.empty() || values.size() != to.size()) throw Error("a ratio needs pairs of values");
  std::vector<double> ratios(values.size());
  std::transform(values.begin(), values.end(), to.begin(), ratios.begin(), std::divides());
  std::mt19937 random(0);
  std::uniform_int_distribution<std::size_t> any(0, ratios.size() - 1);
  std::vector<double> medians(kResamples), resample(ratios.size());
  for (double& each : medians) {
    for (double& value : resample) value = ratios[any(random)];
    each = median(resample);
  }
  std::sort(medians.begin(), medians.end());
  return {median(ratios), medians[kTail], medians[kResamples - 1 - kTail]};
}

void Rounds::add(const Histogram& round) {
  all.merge(round);
  p50_us.push_back(us(round.percentile(0.5)));
  p99_us.push_back(us(round.percentile(0.99)));
}

std::vector<std::pair<std::string, double>> Rounds::values() const {
  return {{"n", static_cast<double>(all.count())},
          {"p50_us", p50()},
          {"p99_us", p99()},
          {"p99.9_us", us(all.percentile(0.999))},
          {"max_us", us(all.max())}};
}

}  // namespace takt::rt
