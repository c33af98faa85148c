// SPDX-License-Identifier: Apache-2.0
#include "run/comparison.hpp"

#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run_fields.hpp"

namespace takt::tools {
namespace {

/// Longer than a run that was asked for may take: its counts are no longer those of the others.
bool is_long(double seconds, Nanoseconds asked) {
  return seconds > 1.05 * rt::us(asked) / 1e6 + 0.05;
}

}  // namespace

void Totals::add(const rt::Run& run) {
  for (const rt::Run::Callback& callback : run.callbacks) {
    const CallbackStatistics& counted = callback.statistics;
    overruns += counted.overruns;
    if (counted.kind == EntityKind::timer) {
      timer_latency.merge(counted.latency);
      continue;
    }
    latency.merge(counted.latency);
    lost += counted.lost();
    merge<CallbackCounts>(messages, counted);
  }
  for (const rt::Run::Chain& chain : run.chains) merge(chains[chain.name], chain.statistics);
  for (const rt::Run::Thread& thread : run.threads) wakeups += static_cast<double>(thread.wakeups);
  for (const rt::Run::Process& process : run.processes) {
    cpu_percent += process.cpu_percent;
    pss_kb += static_cast<double>(process.pss_kb);
  }
}

void add_run(Comparison& row, const rt::Run& run, Nanoseconds asked) {
  if (row.cpu_percent.empty()) row.setup = setup_of(run);
  Totals one;
  one.add(run);
  row.totals.add(run);
  row.seconds += run.duration_s;
  row.is_long = row.is_long || is_long(run.duration_s, asked);
  merge(row.releases, run.releases());
  row.cpu_percent.push_back(one.cpu_percent);
  row.wakeups_per_s.push_back(run.duration_s == 0 ? 0 : one.wakeups / run.duration_s);
  row.pss_mb.push_back(one.pss_kb / 1024);
}

}  // namespace takt::tools
