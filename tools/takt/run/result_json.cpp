// SPDX-License-Identifier: Apache-2.0
#include "run/result_json.hpp"

#include <cmath>
#include <fstream>

#include "takt/base/error.hpp"
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

std::runtime_error not_written(const std::string& what, const std::string& path) {
  return std::runtime_error(Error(what + " could not be written",
                                  "choose a writable file on a disk with free space", path)
                                .what());
}

void write_text(const std::string& text, const std::string& what, const std::string& path) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) throw not_written(what, path);
}

void check_writable(const std::string& path) {
  if (path.empty() || path == "-" || std::ofstream(path, std::ios::app)) return;
  throw Error("results could not be written", "choose a writable file", path);
}

void write_json(const json& document, const std::string& path) {
  const std::string text = rt::json_text(document, 2) + "\n";
  if (path == "-") {
    rt::print("{}", text);
    return;
  }
  write_text(text, "results", path);
}

}  // namespace takt::tools
