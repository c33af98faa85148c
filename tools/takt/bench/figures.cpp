// SPDX-License-Identifier: Apache-2.0
#include "bench/figures.hpp"

#include <algorithm>

#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "run/comparison.hpp"

namespace takt::tools {
namespace {

/// Of chains and timers, as far as there are any.
std::map<std::string, double> chain_figures(const rt::Run& run) {
  std::map<std::string, double> values;
  if (const auto releases = run.releases(); releases.due != 0) {
    values["served_percent"] =
        100 * static_cast<double>(releases.served) / static_cast<double>(releases.due);
  }
  values["starved_timers"] = static_cast<double>(
      std::count_if(run.callbacks.begin(), run.callbacks.end(), [](const auto& callback) {
        return callback.statistics.kind == EntityKind::timer && callback.statistics.received == 0;
      }));
  std::uint64_t instances = 0, misses = 0;
  for (const rt::Run::Chain& chain : run.chains) {
    instances += chain.statistics.instances;
    misses += chain.statistics.misses;
  }
  if (instances == 0) return values;
  values["in_time_percent"] =
      100 * (1 - static_cast<double>(misses) / static_cast<double>(instances));
  const Histogram& latency = run.chains.front().statistics.latency;
  values["chain_p99_ms"] = rt::us(latency.percentile(0.99)) / 1000;
  values["chain_max_ms"] = rt::us(latency.max()) / 1000;
  values["chain_spread_ms"] = rt::us(latency.max() - latency.min()) / 1000;
  return values;
}

}  // namespace

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
  figures.values.merge(chain_figures(run));
  if (variant.message_bytes != 0) {
    figures.values["goodput_mb_s"] =
        received * static_cast<double>(variant.message_bytes) / 1e6 / run.duration_s;
  }
  return figures;
}

}  // namespace takt::tools
