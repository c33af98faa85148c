// SPDX-License-Identifier: Apache-2.0
#include "run/result_json.hpp"

#include <cmath>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {

using nlohmann::json;

Histogram read_histogram(const json& latency) {
  Histogram histogram;
  for (const json& bucket : latency.value("histogram", json::array())) {
    histogram.add_bucket(bucket.at(0).get<std::size_t>(), bucket.at(1).get<std::uint64_t>());
  }
  if (histogram.count() != 0) {
    histogram.set_exact(latency.at("count"), from_us(latency.at("min")), from_us(latency.at("max")),
                        from_us(latency.at("sum")));
  }
  return histogram;
}

Nanoseconds from_us(const json& us) {
  return Nanoseconds(std::llround(us.get<double>() * 1e3));
}

void write_json(const json& document, const std::string& path) {
  const std::string text = rt::json_text(document, 2) + "\n";
  if (path == "-") {
    rt::print("{}", text);
    return;
  }
  write_output(path, std::string(kTaktsJson) + text);
}

}  // namespace takt::tools
