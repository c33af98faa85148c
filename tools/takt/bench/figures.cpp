// SPDX-License-Identifier: Apache-2.0
#include "bench/figures.hpp"

#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "run/comparison.hpp"

namespace takt::tools {

Figures figures_of(const rt::Run& run, const Variant& variant) {
  Totals of;
  of.add(run);
  const auto received = static_cast<double>(of.messages.received);
  Figures figures{{{"pss_mb", of.pss_kb / 1024},
                   {"cpu_percent", of.cpu_percent},
                   {"latency_us", rt::us(of.latency.mean())},
                   {"p50_us", rt::us(of.latency.percentile(0.5))},
                   {"p99_us", rt::us(of.latency.percentile(0.99))},
                   {"received", received},
                   {"lost", static_cast<double>(of.lost)}},
                  of.latency};
  if (variant.message_bytes != 0) {
    figures.values["goodput_mb_s"] =
        received * static_cast<double>(variant.message_bytes) / 1e6 / run.duration_s;
  }
  return figures;
}

}  // namespace takt::tools
