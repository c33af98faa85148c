// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "takt/base/version.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/row_json.hpp"
#include "takt/measuring/run.hpp"
#include "takt/measuring/run_fields.hpp"

namespace takt::rt {
namespace {

Run::Traced traced(const ProcessResult::Thread& thread) {
  Run::Traced traced{.process = thread.process,
                     .executor = thread.executor,
                     .executor_type = thread.executor_type,
                     .scheduler = thread.scheduler,
                     .thread = thread.statistics.in_force.name,
                     .tid = thread.statistics.in_force.tid,
                     .is_realtime = is_realtime(thread.statistics.in_force.policy),
                     .overwritten = thread.statistics.trace_overwritten,
                     .events = json::array()};
  for (const NamedTraceEvent& event : thread.statistics.trace) {
    const auto ns = [](TimePoint time) { return time.time_since_epoch().count(); };
    traced.events.push_back({event.name, std::string(to_string(event.kind)), event.sequence,
                             event.chain_instance, event.lost, ns(event.ready), ns(event.picked),
                             ns(event.start), ns(event.end), event.cpu_time.count(), event.path,
                             event.cause, event.has_waited});
  }
  return traced;
}

}  // namespace

Run::Releases Run::releases() const {
  Releases releases;
  for (const Callback& callback : callbacks) {
    if (callback.statistics.kind != EntityKind::timer) continue;
    releases.served += callback.statistics.received;
    releases.due += callback.statistics.received + callback.statistics.skipped;
    releases.due += callback.statistics.dropped_by_mode;
  }
  return releases;
}

Run run_of(ProcessResult process) {
  Run run{.duration_s = process.duration_s,
          .callbacks = std::move(process.callbacks),
          .chains = std::move(process.chains),
          .executors = std::move(process.executors),
          .deviations = std::move(process.deviations),
          .mode_switches = std::move(process.mode_switches),
          .active_nodes = std::move(process.active_nodes),
          .notes = std::move(process.notes)};
  for (const ProcessResult::Thread& thread : process.threads) {
    const ThreadStatistics& statistics = thread.statistics;
    run.threads.push_back({.process = thread.process,
                           .executor = thread.executor,
                           .name = statistics.in_force.name,
                           .asked = statistics.asked,
                           .in_force = statistics.in_force,
                           .cpu_percent = statistics.cpu_percent(),
                           .spin_percent = statistics.spin_percent(),
                           .wakeups = statistics.counters.voluntary_switches});
    if (statistics.trace.empty()) continue;
    if (!run.trace) run.trace.emplace();
    run.trace->push_back(traced(thread));
  }
  Run::Process& whole = run.processes.emplace_back(
      Run::Process{process.name, process.pss_kb, process.cpu_percent, {}, {}});
  if (process.allocations_counted) {
    whole.allocations_while_spinning = process.allocations_while_spinning;
    whole.allocations_in_dds = process.allocations_in_dds;
  }
  const auto name = [&process](auto& rows) {
    for (auto& row : rows) {
      if (row.process.empty()) row.process = process.name;
    }
  };
  name(run.callbacks);
  name(run.chains);
  name(run.executors);
  name(run.mode_switches);
  name(run.threads);
  if (run.deviations) name(*run.deviations);
  if (run.trace) name(*run.trace);
  return run;
}

json run_json(const Run& run, bool with_buckets) {
  return row_json(run, with_buckets);
}

Run read_run(const json& from, std::string_view where) {
  Run run;
  read_value(from, run, {nullptr, where});
  // An earlier Takt put all on one executor, unless that of the file was kept.
  if (!from.contains("placement")) run.placement = run.executor == "file" ? "file" : "merged";
  return run;
}

std::vector<Run> read_runs(const json& document, std::string_view where) {
  if (!document.is_object() || !document.contains("runs") || !document["runs"].is_array()) {
    throw Error(fmt::format("{}this is no file of results", where),
                "give one that takt run --json or takt compare --save wrote");
  }
  std::vector<Run> runs;
  for (const json& run : document["runs"]) {
    runs.push_back(read_run(run, fmt::format("{}runs[{}]", where, runs.size())));
  }
  return runs;
}

json result_document(const std::vector<Run>& runs, bool with_buckets) {
  return {{"takt", {{"version", TAKT_VERSION}}},
          {"machine", machine_json()},
          {"runs", row_json(runs, with_buckets)}};
}

json bucket_limits_us() {
  json limits = json::array();
  for (std::size_t i = 0; i < Histogram::kBuckets; ++i) {
    limits.push_back(us(Histogram::upper_limit(i)));
  }
  return limits;
}

nlohmann::ordered_json run_schema() {
  return schema_of<Run>();
}

}  // namespace takt::rt
