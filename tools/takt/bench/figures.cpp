// SPDX-License-Identifier: Apache-2.0
#include "bench/figures.hpp"

#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

namespace takt::tools {

Figures figures_of(const rt::Run& run, const Variant& variant) {
  Figures figures;
  double cpu = 0, pss = 0, received = 0, lost = 0;
  for (const rt::Run::Process& process : run.processes) {
    cpu += process.cpu_percent;
    pss += static_cast<double>(process.pss_kb);
  }
  for (const rt::Run::Callback& callback : run.callbacks) {
    if (callback.statistics.kind == EntityKind::timer) continue;
    figures.latency.merge(callback.statistics.latency);
    received += static_cast<double>(callback.statistics.received);
    lost += static_cast<double>(callback.statistics.lost());
  }
  figures.values = {{"pss_mb", pss / 1024},
                    {"cpu_percent", cpu},
                    {"latency_us", rt::us(figures.latency.mean())},
                    {"p50_us", rt::us(figures.latency.percentile(0.5))},
                    {"p99_us", rt::us(figures.latency.percentile(0.99))},
                    {"received", received},
                    {"lost", lost}};
  if (variant.message_bytes != 0) {
    figures.values["goodput_mb_s"] =
        received * static_cast<double>(variant.message_bytes) / 1e6 / run.duration_s;
  }
  return figures;
}

}  // namespace takt::tools
