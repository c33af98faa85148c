// SPDX-License-Identifier: Apache-2.0
#include "bench/figures.hpp"

#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "run/result_json.hpp"

namespace takt::tools {

using nlohmann::json;

Figures figures_of(const json& run, const Variant& variant) {
  Figures figures;
  double cpu = 0, pss = 0, received = 0, lost = 0;
  for (const json& process : run.at("processes")) {
    cpu += process.at("cpu_percent").get<double>();
    pss += process.at("pss_kb").get<double>();
  }
  for (const json& callback : run.at("callbacks")) {
    if (callback.at("kind") == "timer") continue;
    figures.latency.merge(read_histogram(callback.at("latency_us")));
    received += callback.at("received").get<double>();
    lost += callback.at("lost").get<double>();
  }
  figures.values = {{"pss_mb", pss / 1024},
                    {"cpu_percent", cpu},
                    {"latency_us", rt::us(figures.latency.mean())},
                    {"p50_us", rt::us(figures.latency.percentile(0.5))},
                    {"p99_us", rt::us(figures.latency.percentile(0.99))},
                    {"received", received},
                    {"lost", lost}};
  if (variant.message_bytes != 0) {
    figures.values["goodput_mb_s"] = received * static_cast<double>(variant.message_bytes) / 1e6 /
                                     run.at("duration_s").get<double>();
  }
  return figures;
}

}  // namespace takt::tools
