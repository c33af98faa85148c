// SPDX-License-Identifier: Apache-2.0
#include "run/comparison.hpp"

#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run_fields.hpp"

namespace takt::tools {
namespace {

void add_callbacks(Comparison& row, const rt::Run& run) {
  for (const rt::Run::Callback& callback : run.callbacks) {
    const CallbackStatistics& counted = callback.statistics;
    row.overruns += counted.overruns;
    if (counted.kind == EntityKind::timer) {
      row.timer_latency.merge(counted.latency);
      continue;
    }
    row.latency.merge(counted.latency);
    row.lost += counted.lost();
    merge<CallbackCounts>(row.messages, counted);
  }
}

/// Longer than a run that was asked for may take: its counts are no longer those of the others.
bool is_long(double seconds, Nanoseconds asked) {
  return seconds > 1.05 * rt::us(asked) / 1e6 + 0.05;
}

}  // namespace

void add_run(Comparison& row, const rt::Run& run, Nanoseconds asked) {
  if (row.cpu_percent.empty()) row.setup = setup_of(run);
  add_callbacks(row, run);
  const double seconds = run.duration_s;
  row.seconds += seconds;
  row.is_long = row.is_long || is_long(seconds, asked);
  merge(row.releases, run.releases());
  for (const rt::Run::Chain& chain : run.chains) merge(row.chains[chain.name], chain.statistics);
  double cpu_percent = 0, pss_kb = 0, wakeups = 0;
  for (const rt::Run::Thread& thread : run.threads) wakeups += static_cast<double>(thread.wakeups);
  for (const rt::Run::Process& process : run.processes) {
    cpu_percent += process.cpu_percent;
    pss_kb += static_cast<double>(process.pss_kb);
  }
  row.cpu_percent.push_back(cpu_percent);
  row.wakeups_per_s.push_back(seconds == 0 ? 0 : wakeups / seconds);
  row.pss_mb.push_back(pss_kb / 1024);
}

}  // namespace takt::tools
