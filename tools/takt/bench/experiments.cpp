// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments.hpp"

#include <filesystem>

#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/measuring/ddsperf.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

#include "bench/literature.hpp"
#include "embedded.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kManyProcesses{"--composition", "per-node"};
const std::vector<std::string> kOneProcess{"--composition", "single"};
const std::vector<std::string> kOneProcessOverDds{"--composition", "single", "--transport", "dds"};
const std::vector<std::string> kLoaded{"--composition", "dynamic"};
const std::vector<std::string> kLoadedOverDds{"--composition", "dynamic", "--transport", "dds"};

}  // namespace

std::vector<std::string> joined(std::vector<std::string> words,
                                const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::string publish_subscribe(std::int64_t bytes, std::int64_t period_us, int subscribers,
                              int work_us) {
  std::string text = fmt::format(
      "container:\n  name: bench\n  components:\n"
      "    - component: takt::Workload\n      name: publisher\n      parameters:\n"
      "        publishers.topic: [/data]\n        publishers.period_us: [{0}]\n"
      "        publishers.size_bytes: [{1}]\n        publishers.fill_bytes: [{1}]\n",
      period_us, bytes);
  for (int i = 0; i < subscribers; ++i) {
    text += fmt::format(
        "    - component: takt::Workload\n      name: subscriber_{}\n      parameters:\n"
        "        subscriptions.topic: [/data]\n        subscriptions.work_us: [{}]\n",
        i, work_us);
  }
  return text;
}

namespace {

/// A publisher of loaned messages in shared memory, and a subscriber in another process.
std::string publish_subscribe_loaned(std::int64_t bytes, std::int64_t period_us) {
  return fmt::format(
      "dds: {{shared_memory: require}}\ncontainer:\n  name: bench\n  components:\n"
      "    - component: takt::Workload\n      name: publisher\n      parameters:\n"
      "        publishers.topic: [/data]\n        publishers.period_us: [{0}]\n"
      "        publishers.fixed_bytes: [{1}]\n        publishers.fill_bytes: [{1}]\n"
      "    - component: takt::Workload\n      name: subscriber\n      parameters:\n"
      "        subscriptions.topic: [/data]\n        subscriptions.fixed_bytes: [{1}]\n",
      period_us, bytes);
}

std::string why_no_loans() {
  return RoudiProcess::is_installed() || find_roudi().pid != 0
             ? ""
             : "iox-roudi is missing: apt-get install iceoryx";
}

/// Nodes without a topic or a timer.
std::string empty_nodes(int count) {
  std::string text = "container:\n  name: bench\n  components:\n";
  for (int i = 0; i < count; ++i) {
    text += fmt::format("    - component: takt::Workload\n      name: node_{}\n", i);
  }
  return text;
}

std::vector<Variant> memory(const BenchOptions&) {
  std::vector<Variant> variants;
  for (const int nodes : {1, 2, 3, 5, 10, 15, 20}) {
    const std::string system = empty_nodes(nodes);
    variants.push_back({"multi_process", nodes * 1.0, system, kManyProcesses});
    variants.push_back({"manual", nodes * 1.0, system, kOneProcessOverDds});
    variants.push_back({"dynamic", nodes * 1.0, system, kLoadedOverDds});
    variants.push_back({"manual, without DDS", nodes * 1.0, system, kOneProcess});
  }
  return variants;
}

std::vector<Variant> latency_by_size(const BenchOptions&) {
  std::vector<Variant> variants;
  for (const int kb : {1, 50, 100, 500, 1000, 5000}) {
    const std::string system = publish_subscribe(kb * 1000, 20'000, 1, 0);
    variants.push_back({"multi_process", kb * 1.0, system, kManyProcesses});
    variants.push_back({.series = "multi_process_loaned",
                        .x = kb * 1.0,
                        .system = publish_subscribe_loaned(kb * 1000, 20'000),
                        .words = kManyProcesses,
                        .missing = why_no_loans()});
    variants.push_back({"manual", kb * 1.0, system, kOneProcessOverDds});
    variants.push_back({"dynamic", kb * 1.0, system, kLoadedOverDds});
    variants.push_back({"ipc", kb * 1.0, system, kOneProcess});
  }
  return variants;
}

const std::vector<std::string> kGoodputDeviations{
    "multi_process_loaned sends without a pause; the paper limited it to 450 Hz.",
    "composition is created with its process; the paper loads it.",
    "ddsperf, of Cyclone DDS, is not in the paper."};

std::vector<Variant> goodput(const BenchOptions&) {
  std::vector<Variant> variants;
  for (const std::int64_t kb : {50, 100, 500, 1000, 5000}) {
    // A period shorter than the work: so the publisher writes as fast as it can.
    const std::string system = publish_subscribe(kb * 1000, 1, 1, 0);
    const auto x = static_cast<double>(kb);
    variants.push_back({"multi_process", x, system, kManyProcesses, kb * 1000, {}});
    variants.push_back({.series = "multi_process_loaned",
                        .x = x,
                        .system = publish_subscribe_loaned(kb * 1000, 1),
                        .words = kManyProcesses,
                        .message_bytes = kb * 1000,
                        .missing = why_no_loans()});
    variants.push_back({.series = "ddsperf",
                        .x = x,
                        .message_bytes = kb * 1000,
                        .missing = rt::why_no_ddsperf(),
                        .is_ddsperf = true});
    variants.push_back({"composition", x, system, kOneProcessOverDds, kb * 1000, {}});
    variants.push_back({"ipc", x, system, kOneProcess, kb * 1000, {}});
  }
  return variants;
}

std::vector<Variant> executors_by_subscribers(const BenchOptions&) {
  std::vector<Variant> variants;
  for (const int subscribers : {1, 5, 10}) {
    const std::string system = publish_subscribe(500'000, 20'000, subscribers, 500);
    for (const std::string& executor : executors().names()) {
      variants.push_back({executor, subscribers * 1.0, system,
                          joined(kOneProcessOverDds, {"--executor", executor})});
    }
  }
  return variants;
}

const std::string kModelled =
    "The graph has the robot's nodes, rates and sizes; the work of its callbacks is assumed.";

std::vector<Variant> robot(const std::string& system) {
  // A node in a separate process has one thread, whatever the file configures for a shared process.
  std::vector<Variant> variants{
      {"multi_process", 0, system, joined(kManyProcesses, {"--executor", "single_threaded"})}};
  const auto add = [&](const char* series, const std::string& text,
                       const std::vector<std::string>& words,
                       const std::vector<const char*>& executors) {
    for (const char* executor : executors) {
      variants.push_back({fmt::format("{}, {}", series, executor), 0, text,
                          joined(words, {"--executor", executor})});
    }
  };
  add("manual", system, kOneProcess, {"single_threaded", "isolated", "multi_threaded", "events"});
  // Loading needs DDS; so the variant to compare with is the same system, not loaded, with DDS.
  add("manual with DDS", "dds: {parameter_services: false}\n" + system, kOneProcess,
      {"isolated", "multi_threaded"});
  add("dynamic", system, kLoaded, {"isolated", "multi_threaded"});
  return variants;
}

const std::vector<std::string> kReferenceDeviations{
    "Upstream does not show the first two columns, from the release of the front lidar.",
    "The others are counted as upstream counts them: a sample is a message that reaches a "
    "command node, and the first nine are skipped. Its latency is from the start of the later "
    "lidar's timer to the start of the collision estimator. Its drops are the messages "
    "overwritten before each node of the hot path that it has come through. Upstream shows "
    "drops divided by samples.",
    "A callback works for 2 ms of CPU time; upstream searches prime numbers for as long as "
    "its machine takes.",
    "The history of a sample comes from the trace; upstream sends it with the message."};

std::vector<Variant> reference_system(const BenchOptions&) {
  std::vector<Variant> variants;
  for (const std::string& executor : executors().names()) {
    variants.push_back({.series = executor,
                        .system = kReferenceSystem,
                        .words = joined(kOneProcess, {"--executor", executor}),
                        .is_reference_system = true});
  }
  // With the executor of the file: chain_aware, with Takt's assignment from the hot path.
  variants.push_back({.series = "takt plan",
                      .system = kReferenceSystem,
                      .words = kOneProcess,
                      .is_reference_system = true});
  return variants;
}

std::vector<Variant> topologies(const BenchOptions& options) {
  if (options.files.empty()) {
    throw Error("takt bench topologies needs files",
                "name workloads of irobot-ros/ros2-performance, or configuration files: takt bench "
                "topologies sierra_nevada.json");
  }
  std::vector<Variant> variants;
  for (const std::string& file : options.files) {
    for (const std::string& executor : executors().names()) {
      variants.push_back({fmt::format("{}, {}", fs::path(file).stem().string(), executor),
                          0,
                          file,
                          {"--executor", executor}});
    }
  }
  return variants;
}

}  // namespace

const std::map<std::string, std::string>& labels() {
  static const std::map<std::string, std::string> all{
      {"pss_mb", "memory, PSS (MB)"},
      {"cpu_percent", "CPU (% of one core)"},
      {"latency_us", "mean latency (µs)"},
      {"p99_us", "p99 latency (µs)"},
      {"goodput_mb_s", "goodput (MB/s)"},
      {"hot_path_release_ms", "hot path from release: front lidar due → end, median (ms)"},
      {"hot_path_release_max_ms", "hot path from release, maximum (ms)"},
      {"hot_path_ms", "hot path as upstream: later lidar's start → start, mean (ms)"},
      {"hot_path_max_ms", "hot path as upstream, maximum (ms)"},
      {"hot_path_drops", "hot path drops"},
      {"hot_path_samples", "hot path samples"},
      {"planner_deviation_ms", "planner's period, standard deviation (ms)"},
      {"chain_p99_ms", "p99 latency of the first chain (ms)"},
      {"chain_max_ms", "longest latency of the first chain (ms)"},
      {"chain_spread_ms", "latency of the first chain, longest − shortest (ms)"},
      {"in_time_percent", "instances of chains in time (%)"},
      {"served_percent", "releases of timers that were served (%)"},
      {"starved_timers", "timers that never ran"}};
  return all;
}

namespace {

std::vector<Experiment> of_composition() {
  return {
      {"memory",
       "Memory against the number of empty nodes",
       "nodes",
       {"pss_mb"},
       memory,
       {"Of multi_process, the command takt that starts the others counts, too.",
        "'manual, without DDS' is not in the paper."}},
      {"latency",
       "Latency and CPU against the size of messages, 50 Hz",
       "message size (KB)",
       {"latency_us", "cpu_percent"},
       latency_by_size,
       {"Of multi_process, the CPU time of the command takt that started the others counts, too; "
        "of multi_process_loaned, also that of RouDi if the run started it.",
        "The paper has no multi_process_loaned of 5 MB, as its messages crashed there."}},
      {"goodput",
       "Goodput against the size of messages",
       "message size (KB)",
       {"goodput_mb_s", "cpu_percent"},
       goodput,
       kGoodputDeviations},
      {"executors",
       "500 KB at 50 Hz to subscribers with 500 µs of work",
       "subscribers",
       {"latency_us", "cpu_percent"},
       executors_by_subscribers,
       {"The nodes are created with their process; the paper loads them.",
        "All executors but single_threaded, isolated and multi_threaded are not in the paper."}},
      {"nav2",
       "A Nav2-like robot",
       "",
       {"pss_mb", "cpu_percent", "latency_us"},
       [](const BenchOptions&) { return robot(kNav2Robot); },
       {kModelled}},
      {"create3",
       "A Create 3-like robot",
       "",
       {"pss_mb", "cpu_percent", "latency_us"},
       [](const BenchOptions&) { return robot(kCreate3Robot); },
       {kModelled}},
      {"reference_system",
       "The Autoware reference system",
       "",
       {"hot_path_release_ms", "hot_path_release_max_ms", "hot_path_ms", "hot_path_max_ms",
        "hot_path_drops", "hot_path_samples", "planner_deviation_ms", "cpu_percent"},
       reference_system,
       kReferenceDeviations,
       false},
      {"topologies",
       "Topologies of irobot-ros/ros2-performance",
       "",
       {"latency_us", "p99_us", "cpu_percent", "pss_mb"},
       topologies,
       {},
       false},
  };
}

}  // namespace

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = [] {
    std::vector<Experiment> those = of_composition();
    for (Experiment& experiment : literature()) those.push_back(std::move(experiment));
    return those;
  }();
  return all;
}

}  // namespace takt::tools
