// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/process_json.hpp"

#include "takt/base/version.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/rounds.hpp"

namespace takt::rt {
namespace {

using nlohmann::json;

json histogram_json(const Histogram& histogram, bool with_buckets) {
  // null without samples: 0 would look like a perfect latency.
  const auto us = [&](Nanoseconds value) {
    return histogram.count() == 0 ? json() : json(rt::us(value));
  };
  json result = {{"count", histogram.count()},
                 {"sum", us(histogram.sum())},
                 {"mean", us(histogram.mean())},
                 {"min", us(histogram.min())},
                 {"p50", us(histogram.percentile(0.5))},
                 {"p90", us(histogram.percentile(0.9))},
                 {"p99", us(histogram.percentile(0.99))},
                 {"p999", us(histogram.percentile(0.999))},
                 {"max", us(histogram.max())}};
  if (histogram.is_saturated()) result["saturated"] = true;
  if (with_buckets) {
    json buckets = json::array();
    histogram.for_each_bucket([&](std::size_t bucket, Nanoseconds, std::uint64_t count) {
      buckets.push_back({bucket, count});
    });
    result["histogram"] = std::move(buckets);
  }
  return result;
}

/// The common fields of ThreadAttributes and ThreadState.
template <class Attributes>
json attributes_json(const Attributes& attributes) {
  json result = {{"policy", std::string(to_string(attributes.policy))},
                 {"priority", attributes.priority},
                 {"nice", attributes.nice},
                 {"affinity", attributes.affinity}};
  if (attributes.policy == ThreadPolicy::deadline) {
    result["runtime_us"] = us(attributes.runtime);
    result["deadline_us"] = us(attributes.deadline);
    result["period_us"] = us(attributes.period);
  }
  return result;
}

json trace_json(const std::string& process, const ProcessResult::Thread& of) {
  const ThreadStatistics& thread = of.statistics;
  json events = json::array();
  for (const NamedTraceEvent& event : thread.trace) {
    const auto ns = [](TimePoint time) { return time.time_since_epoch().count(); };
    events.push_back({event.name, std::string(to_string(event.kind)), event.sequence,
                      event.chain_instance, event.lost, ns(event.ready), ns(event.picked),
                      ns(event.start), ns(event.end), event.cpu_time.count(), event.path,
                      event.cause, event.has_waited});
  }
  return {{"process", process},
          {"executor", of.executor},
          {"executor_type", of.executor_type},
          {"scheduler", of.scheduler},
          {"thread", thread.in_force.name},
          {"tid", thread.in_force.tid},
          {"is_realtime", is_realtime(thread.in_force.policy)},
          {"overwritten", thread.trace_overwritten},
          {"events", std::move(events)}};
}

json callbacks_json(const ProcessResult& process) {
  json callbacks = json::array();
  for (const auto& callback : process.callbacks) {
    const CallbackStatistics& statistics = callback.statistics;
    const auto of_known_period = [&statistics](std::uint64_t count) {
      return statistics.with_period == 0 ? json() : json(count);
    };
    callbacks.push_back({{"process", process.name},
                         {"executor", callback.executor},
                         {"node", statistics.node},
                         {"group", statistics.group},
                         {"callback", statistics.callback},
                         {"kind", std::string(to_string(statistics.kind))},
                         {"topic", statistics.topic},
                         {"received", statistics.received},
                         {"expected", statistics.expected},
                         {"from_outside", statistics.from_outside},
                         {"lost", callback.lost()},
                         {"dropped", statistics.dropped},
                         {"late", of_known_period(statistics.late)},
                         {"too_late", of_known_period(statistics.too_late)},
                         {"deadline_misses", statistics.deadline_misses},
                         {"overruns", statistics.overruns},
                         {"skipped", statistics.skipped},
                         {"latency_us", histogram_json(statistics.latency, true)},
                         {"waiting_us", histogram_json(statistics.waiting, true)},
                         {"take_us", histogram_json(statistics.take, true)},
                         {"execution_us", histogram_json(statistics.execution, true)}});
  }
  return callbacks;
}

json chains_json(const ProcessResult& process) {
  json chains = json::array();
  for (const auto& chain : process.chains) {
    chains.push_back({{"process", process.name},
                      {"name", chain.name},
                      {"deadline_us", us(chain.deadline)},
                      {"instances", chain.statistics.instances},
                      {"misses", chain.statistics.misses},
                      {"aborted", chain.statistics.aborted},
                      {"latency_us", histogram_json(chain.statistics.latency, true)}});
  }
  return chains;
}

}  // namespace

json result_document(json runs) {
  return {{"takt", {{"version", TAKT_VERSION}}},
          {"machine", rt::machine_json()},
          {"runs", std::move(runs)}};
}

json bucket_limits_us() {
  json limits = json::array();
  for (std::size_t i = 0; i < Histogram::kBuckets; ++i) {
    limits.push_back(us(Histogram::upper_limit(i)));
  }
  return limits;
}

json process_json(const ProcessResult& process) {
  json threads = json::array(), trace = json::array();
  for (const auto& thread : process.threads) {
    const ThreadStatistics& statistics = thread.statistics;
    json in_force = attributes_json(statistics.in_force);
    if (!statistics.in_force.refused.empty()) in_force["refused"] = statistics.in_force.refused;
    threads.push_back({{"process", process.name},
                       {"executor", thread.executor},
                       {"name", statistics.in_force.name},
                       {"asked", attributes_json(statistics.asked)},
                       {"in_force", std::move(in_force)},
                       {"cpu_percent", statistics.cpu_percent()},
                       {"spin_percent", statistics.spin_percent()},
                       {"wakeups", statistics.counters.voluntary_switches}});
    if (!statistics.trace.empty()) {
      trace.push_back(trace_json(process.name, thread));
    }
  }
  json executors = json::array();
  for (const auto& executor : process.executors) {
    executors.push_back({{"process", process.name},
                         {"name", executor.name},
                         {"type", executor.type},
                         {"scheduler", executor.scheduler},
                         {"threads_given", executor.threads_given}});
  }
  const auto counted = [&](std::uint64_t count) {
    return process.allocations_counted ? json(count) : json();
  };
  return {
      {"duration_s", process.duration_s},
      {"callbacks", callbacks_json(process)},
      {"chains", chains_json(process)},
      {"executors", std::move(executors)},
      {"threads", std::move(threads)},
      {"processes",
       json::array({{{"name", process.name},
                     {"pss_kb", process.pss_kb},
                     {"cpu_percent", process.cpu_percent},
                     {"allocations_while_spinning", counted(process.allocations_while_spinning)},
                     {"allocations_in_dds", counted(process.allocations_in_dds)}}})},
      {"trace", std::move(trace)},
      {"notes", process.notes},
      {"failed", process.failures}};
}

Releases releases_of(const json& run) {
  Releases releases;
  for (const json& callback : run.at("callbacks")) {
    if (callback.at("kind") != "timer") continue;
    const auto served = callback.at("received").get<std::uint64_t>();
    releases.served += served;
    releases.due += served + callback.at("skipped").get<std::uint64_t>();
  }
  return releases;
}

}  // namespace takt::rt
