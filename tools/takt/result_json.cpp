// SPDX-License-Identifier: Apache-2.0
#include "result_json.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <fstream>
#include <thread>

namespace takt::tools {
namespace {

using nlohmann::json;

double us(Nanoseconds duration) { return static_cast<double>(duration.count()) / 1e3; }

std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

json machine() {
  utsname name{};
  uname(&name);
  double load = 0;
  std::ifstream("/proc/loadavg") >> load;
  return {{"cpu", cpu_model()},       {"cpus", std::thread::hardware_concurrency()},
          {"kernel", name.release},   {"kernel_version", name.version},
          {"architecture", name.machine}, {"load_average", load},
          {"compiler", __VERSION__}};
}

json histogram_json(const Histogram& histogram, bool with_buckets) {
  json result = {{"mean", us(histogram.mean())},
                 {"p50", us(histogram.percentile(0.5))},
                 {"p90", us(histogram.percentile(0.9))},
                 {"p99", us(histogram.percentile(0.99))},
                 {"p999", us(histogram.percentile(0.999))},
                 {"max", us(histogram.max())}};
  if (with_buckets) {
    json buckets = json::array();
    histogram.for_each_bucket([&](std::size_t bucket, Nanoseconds, std::uint64_t count) {
      buckets.push_back({bucket, count});
    });
    result["histogram"] = std::move(buckets);
  }
  return result;
}

json attributes_json(const ThreadAttributes& asked) {
  return {{"policy", std::string(to_string(asked.policy))},
          {"priority", asked.priority},
          {"nice", asked.nice},
          {"affinity", asked.affinity}};
}

}  // namespace

json result_document(json runs) {
  return {{"takt", {{"version", TAKT_VERSION}}}, {"machine", machine()}, {"runs", std::move(runs)}};
}

json run_json(const RunDescription& description, const ProcessResult& process,
              bool with_histograms) {
  json callbacks = json::array();
  for (const auto& callback : process.callbacks) {
    const CallbackStatistics& statistics = callback.statistics;
    callbacks.push_back({{"process", process.name},
                         {"executor", callback.executor},
                         {"node", statistics.node},
                         {"group", statistics.group},
                         {"callback", statistics.callback},
                         {"kind", std::string(to_string(statistics.kind))},
                         {"topic", statistics.topic},
                         {"received", statistics.received},
                         {"expected", statistics.expected},
                         {"lost", callback.lost()},
                         {"dropped", statistics.dropped},
                         {"late", statistics.late},
                         {"too_late", statistics.too_late},
                         {"deadline_misses", statistics.deadline_misses},
                         {"overruns", statistics.overruns},
                         {"latency_us", histogram_json(statistics.latency, with_histograms)},
                         {"execution_us", histogram_json(statistics.execution, with_histograms)}});
  }
  json threads = json::array();
  for (const auto& thread : process.threads) {
    const ThreadStatistics& statistics = thread.statistics;
    json in_force = {{"policy", std::string(to_string(statistics.in_force.policy))},
                     {"priority", statistics.in_force.priority},
                     {"nice", statistics.in_force.nice},
                     {"affinity", statistics.in_force.affinity}};
    if (!statistics.in_force.refused.empty()) in_force["refused"] = statistics.in_force.refused;
    threads.push_back({{"process", process.name},
                       {"executor", thread.executor},
                       {"name", statistics.in_force.name},
                       {"asked", attributes_json(statistics.asked)},
                       {"in_force", std::move(in_force)},
                       {"cpu_percent", statistics.cpu_percent()},
                       {"wakeups", statistics.counters.voluntary_switches}});
  }
  json notes = process.notes;
  return {{"file", description.file},
          {"executor", description.executor},
          {"scheduler", description.scheduler},
          {"composition", description.composition},
          {"transport", description.transport},
          {"duration_s", process.duration_s},
          {"repeat", description.repeat},
          {"callbacks", std::move(callbacks)},
          {"chains", json::array()},
          {"threads", std::move(threads)},
          {"processes",
           json::array({{{"name", process.name},
                         {"pss_kb", process.pss_kb},
                         {"cpu_percent", process.cpu_percent},
                         {"allocations_while_spinning",
                          process.allocations_counted ? json(process.allocations_while_spinning)
                                                      : json()}}})},
          {"notes", std::move(notes)}};
}

Histogram read_histogram(const json& latency) {
  Histogram histogram;
  for (const json& bucket : latency.value("histogram", json::array())) {
    histogram.add_bucket(bucket.at(0).get<std::size_t>(), bucket.at(1).get<std::uint64_t>());
  }
  return histogram;
}

void write_json(const json& document, const std::string& path) {
  const std::string text = document.dump(2) + "\n";
  if (path == "-") {
    fmt::print("{}", text);
    return;
  }
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) throw Error("results could not be written", "choose a place that can be", path);
}

}  // namespace takt::tools
