// SPDX-License-Identifier: Apache-2.0
#include "run/comparison.hpp"

#include "takt/measuring/rounds.hpp"

#include "run/result_json.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

void add_callbacks(Comparison& row, const json& run) {
  for (const json& callback : run.at("callbacks")) {
    const Histogram histogram = read_histogram(callback.at("latency_us"));
    const auto sum = [&callback](const char* key, std::uint64_t& into) {
      into += callback.at(key).get<std::uint64_t>();
    };
    sum("overruns", row.overruns);
    if (callback.at("kind") == "timer") {
      row.timer_latency.merge(histogram);
      continue;
    }
    row.latency.merge(histogram);
    sum("received", row.received);
    sum("lost", row.lost);
    sum("dropped", row.dropped);
    const auto sum_known = [&callback](const char* key, std::optional<std::uint64_t>& into) {
      const json& count = callback.at(key);
      if (!count.is_null()) into = into.value_or(0) + count.get<std::uint64_t>();
    };
    sum_known("late", row.late);
    sum_known("too_late", row.too_late);
    sum("deadline_misses", row.deadline_misses);
  }
}

/// Longer than a run that was asked for may take: its counts are no longer those of the others.
bool is_long(double seconds, Nanoseconds asked) {
  return seconds > 1.05 * rt::us(asked) / 1e6 + 0.05;
}

}  // namespace

void add_run(Comparison& row, const json& run, Nanoseconds asked) {
  if (row.cpu_percent.empty()) row.setup = setup_of(run);
  add_callbacks(row, run);
  const double seconds = run.at("duration_s");
  row.seconds += seconds;
  row.is_long = row.is_long || is_long(seconds, asked);
  row.releases.due += run.at("releases").at("due").get<std::uint64_t>();
  row.releases.served += run.at("releases").at("served").get<std::uint64_t>();
  for (const json& chain : run.at("chains")) {
    ChainComparison& sum = row.chains[chain.at("name")];
    sum.instances += chain.at("instances").get<std::uint64_t>();
    sum.misses += chain.at("misses").get<std::uint64_t>();
    sum.aborted += chain.at("aborted").get<std::uint64_t>();
    sum.latency.merge(read_histogram(chain.at("latency_us")));
  }
  double cpu_percent = 0, pss_kb = 0, wakeups = 0;
  for (const json& thread : run.at("threads")) wakeups += thread.at("wakeups").get<double>();
  for (const json& process : run.at("processes")) {
    cpu_percent += process.at("cpu_percent").get<double>();
    pss_kb += process.at("pss_kb").get<double>();
  }
  row.cpu_percent.push_back(cpu_percent);
  row.wakeups_per_s.push_back(seconds == 0 ? 0 : wakeups / seconds);
  row.pss_mb.push_back(pss_kb / 1024);
}

}  // namespace takt::tools
