// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/rounds.hpp"

#include <algorithm>

namespace takt::rt {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
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
