// takt bench: the experiments of the paper "Impact of ROS 2 Node Composition in Robotic Systems"
// and the robots that it names, each with one command.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <unistd.h>

#include "takt/containers/configuration/duration.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/ddsperf.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

#include "commands.hpp"
#include "embedded.hpp"
#include "report.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"
#include "table.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Options {
  std::string name, duration = "2s", report, json;
  std::vector<std::string> files;
  int repeat = 3;
};

/// One point of a curve, or one row of a table.
struct Variant {
  std::string series;
  double x = 0;
  std::string system;                // the text of a configuration file, or the path of one
  std::vector<std::string> words;    // more of the command line
  std::int64_t message_bytes = 0;    // for goodput
  std::string missing;               // why it cannot be run here
  bool is_reference_system = false;  // its key figures come from a trace
  bool is_ddsperf = false;           // not Takt at all
};

struct Experiment {
  std::string name, title, x_label;  // no label: a table, not curves
  std::vector<std::string> metrics;  // the keys that matter, in this order
  std::function<std::vector<Variant>(const Options&)> variants;
};

const std::vector<std::string> kManyProcesses{"--composition", "per-node"};
const std::vector<std::string> kOneProcess{"--composition", "single"};
const std::vector<std::string> kOneProcessOverDds{"--composition", "single", "--transport", "dds"};
const std::vector<std::string> kLoaded{"--composition", "dynamic"};
const std::vector<std::string> kLoadedOverDds{"--composition", "dynamic", "--transport", "dds"};

std::vector<std::string> joined(std::vector<std::string> words,
                                const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// A publisher, and so many subscribers in nodes of their own.
std::string publish_subscribe(std::int64_t bytes, std::int64_t period_us, int subscribers,
                              int work_us, std::int64_t fill_bytes = 0) {
  std::string text = fmt::format(
      "container:\n  name: bench\n  components:\n"
      "    - component: takt::Workload\n      name: publisher\n      parameters:\n"
      "        publishers.topic: [/data]\n        publishers.period_us: [{}]\n"
      "        publishers.size_bytes: [{}]\n        publishers.fill_bytes: [{}]\n",
      period_us, bytes, fill_bytes);
  for (int i = 0; i < subscribers; ++i) {
    text += fmt::format(
        "    - component: takt::Workload\n      name: subscriber_{}\n      parameters:\n"
        "        subscriptions.topic: [/data]\n        subscriptions.work_us: [{}]\n",
        i, work_us);
  }
  return text;
}

/// A publisher that lends shared memory, and a subscriber in another process.
std::string publish_subscribe_loaned(std::int64_t bytes, std::int64_t period_us,
                                     std::int64_t fill_bytes = 0) {
  return fmt::format(
      "dds: {{shared_memory: require}}\ncontainer:\n  name: bench\n  components:\n"
      "    - component: takt::Workload\n      name: publisher\n      parameters:\n"
      "        publishers.topic: [/data]\n        publishers.period_us: [{0}]\n"
      "        publishers.fixed_bytes: [{1}]\n        publishers.fill_bytes: [{2}]\n"
      "    - component: takt::Workload\n      name: subscriber\n      parameters:\n"
      "        subscriptions.topic: [/data]\n        subscriptions.fixed_bytes: [{1}]\n",
      period_us, bytes, fill_bytes);
}
std::string why_no_loans() {
  return RoudiProcess::is_installed() || find_roudi().pid != 0
             ? ""
             : "iox-roudi is missing: apt-get install iceoryx";
}

/// So many nodes, each of which publishes 1 KB at 10 Hz and listens to its neighbour.
std::string ring_of_nodes(int count) {
  std::string text = "container:\n  name: bench\n  components:\n";
  for (int i = 0; i < count; ++i) {
    text += fmt::format(
        "    - component: takt::Workload\n      name: node_{0}\n      parameters:\n"
        "        publishers.topic: [/ring_{0}]\n        publishers.period_us: [100000]\n"
        "        publishers.size_bytes: [1024]\n        subscriptions.topic: [/ring_{1}]\n",
        i, (i + 1) % count);
  }
  return text;
}

std::vector<Variant> memory(const Options&) {
  std::vector<Variant> variants;
  for (const int nodes : {1, 2, 3, 5, 10, 15, 20}) {
    const std::string system = ring_of_nodes(nodes);
    variants.push_back({"multi_process", nodes * 1.0, system, kManyProcesses});
    variants.push_back({"manual", nodes * 1.0, system, kOneProcessOverDds});
    variants.push_back({"dynamic", nodes * 1.0, system, kLoadedOverDds});
    variants.push_back({"manual, without DDS", nodes * 1.0, system, kOneProcess});
  }
  return variants;
}

std::vector<Variant> latency_by_size(const Options&) {
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

std::vector<Variant> goodput(const Options&) {
  std::vector<Variant> variants;
  for (const std::int64_t kb : {50, 100, 500, 1000, 5000}) {
    // Always due: as much as the publisher can write.
    const std::string system = publish_subscribe(kb * 1000, 1, 1, 0, kb * 1000);
    const auto x = static_cast<double>(kb);
    variants.push_back({"multi_process", x, system, kManyProcesses, kb * 1000, {}});
    variants.push_back({.series = "multi_process_loaned",
                        .x = x,
                        .system = publish_subscribe_loaned(kb * 1000, 1, kb * 1000),
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

std::vector<Variant> executors_by_subscribers(const Options&) {
  std::vector<Variant> variants;
  for (const int subscribers : {1, 5, 10}) {
    const std::string system = publish_subscribe(500'000, 20'000, subscribers, 500);
    for (const std::string& executor : executors().names()) {
      variants.push_back(
          {executor, subscribers * 1.0, system, joined(kOneProcess, {"--executor", executor})});
    }
  }
  return variants;
}

std::vector<Variant> robot(const std::string& system) {
  // Whoever is in a process of its own has one thread, whatever the file says of all together.
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
  // Whoever loads comes over DDS; so beside what is loaded stands what is not, with the same.
  add("manual with DDS", "dds: {parameter_services: false}\n" + system, kOneProcess,
      {"isolated", "multi_threaded"});
  add("dynamic", system, kLoaded, {"isolated", "multi_threaded"});
  return variants;
}

std::vector<Variant> reference_system(const Options&) {
  std::vector<Variant> variants;
  for (const std::string& executor : executors().names()) {
    variants.push_back({.series = executor,
                        .system = kReferenceSystem,
                        .words = joined(kOneProcess, {"--executor", executor}),
                        .is_reference_system = true});
  }
  // As the file says: chain_aware, with Takt's assignment from the hot path.
  variants.push_back({.series = "takt plan",
                      .system = kReferenceSystem,
                      .words = kOneProcess,
                      .is_reference_system = true});
  return variants;
}

std::vector<Variant> topologies(const Options& options) {
  if (options.files.empty()) {
    throw Error("takt bench topologies needs files",
                "give workloads of irobot-ros/ros2-performance, or configuration files: takt bench "
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

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all{
      {"memory", "Memory against the number of nodes", "nodes", {"pss_mb"}, memory},
      {"latency",
       "Latency and CPU against the size of messages, 50 Hz",
       "message size (KB)",
       {"latency_us", "cpu_percent"},
       latency_by_size},
      {"goodput",
       "Goodput against the size of messages",
       "message size (KB)",
       {"goodput_mb_s", "cpu_percent"},
       goodput},
      {"executors",
       "500 KB at 50 Hz to subscribers with 500 µs of work",
       "subscribers",
       {"latency_us", "cpu_percent"},
       executors_by_subscribers},
      {"nav2",
       "A Nav2-like robot",
       "",
       {"pss_mb", "cpu_percent", "latency_us"},
       [](const Options&) { return robot(kNav2Robot); }},
      {"create3",
       "A Create 3-like robot",
       "",
       {"pss_mb", "cpu_percent", "latency_us"},
       [](const Options&) { return robot(kCreate3Robot); }},
      {"reference_system",
       "The Autoware reference system",
       "",
       {"hot_path_ms", "hot_path_max_ms", "hot_path_drops", "planner_jitter_ms", "cpu_percent"},
       reference_system},
      {"topologies",
       "Topologies of irobot-ros/ros2-performance",
       "",
       {"latency_us", "p99_us", "cpu_percent", "pss_mb"},
       topologies},
  };
  return all;
}

/// What one run is worth, by metric, and its histogram.
struct Figures {
  std::map<std::string, double> values;
  Histogram latency;
};

Figures figures_of(const json& run, const Variant& variant) {
  Figures figures;
  double cpu = 0, pss = 0, received = 0, lost = 0;
  for (const json& process : run.at("processes")) {
    cpu += process.at("cpu_percent").get<double>();
    pss += process.at("pss_kb").get<double>();
  }
  for (const json& callback : run.at("callbacks")) {
    if (callback.at("kind") == "timer") continue;
    figures.latency.merge(read_histogram(callback.at("latency_us")));
    received += callback.at("received").get<double>();
    lost += callback.at("lost").get<double>();
  }
  figures.values = {{"pss_mb", pss / 1024},
                    {"cpu_percent", cpu},
                    {"latency_us", rt::us(figures.latency.mean())},
                    {"p50_us", rt::us(figures.latency.percentile(0.5))},
                    {"p99_us", rt::us(figures.latency.percentile(0.99))},
                    {"received", received},
                    {"lost", lost}};
  if (variant.message_bytes != 0) {
    figures.values["goodput_mb_s"] = received * static_cast<double>(variant.message_bytes) / 1e6 /
                                     run.at("duration_s").get<double>();
  }
  return figures;
}

/// The key figures of ros-realtime/reference-system, from a timeline. Hot path: from the start of a
/// lidar's timer to the start of the collision estimator on what came of it, and what was
/// overwritten on the way. Planner: how far the distance of its cycles is from 100 ms, on the
/// average.
std::map<std::string, double> key_figures(const json& timeline) {
  static const std::vector<std::string> hot_path{
      "/FrontLidarDriver/",         "/RearLidarDriver/",         "/PointsTransformerFront/",
      "/PointsTransformerRear/",    "/PointCloudFusion/",        "/RayGroundFilter/",
      "/EuclideanClusterDetector/", "/ObjectCollisionEstimator/"};
  std::map<std::uint64_t, double> roots;  // chain instance → start
  std::vector<double> latencies_ms, planner_starts_ms;
  double drops = 0;
  const auto is_of = [](const std::string& name, const std::string& node) {
    return name.starts_with(node) && name.find("EuclideanClusterSettings") == name.npos;
  };
  for (const json& event : timeline.at("traceEvents")) {
    const std::string name = event.at("name");
    if (event.at("ph") == "i" &&
        std::any_of(hot_path.begin(), hot_path.end(),
                    [&](const std::string& node) { return is_of(name, node); })) {
      drops += std::stod(name.substr(name.rfind(' ')));
    }
    if (event.at("ph") != "X") continue;
    const double start_ms = event.at("ts").get<double>() / 1e3;
    const std::uint64_t chain = event.at("args").at("chain_instance");
    if (is_of(name, hot_path[0]) || is_of(name, hot_path[1])) roots[chain] = start_ms;
    if (is_of(name, hot_path.back())) {
      if (const auto root = roots.find(chain); root != roots.end()) {
        latencies_ms.push_back(start_ms - root->second);
      }
    }
    if (name.starts_with("/BehaviorPlanner/") && event.at("cat") == "timer") {
      planner_starts_ms.push_back(start_ms);
    }
  }
  double jitter_ms = 0;
  for (std::size_t i = 1; i < planner_starts_ms.size(); ++i) {
    jitter_ms += std::abs(planner_starts_ms[i] - planner_starts_ms[i - 1] - 100) /
                 static_cast<double>(planner_starts_ms.size() - 1);
  }
  return {{"hot_path_ms", rt::median(latencies_ms)},
          {"hot_path_max_ms",
           latencies_ms.empty() ? 0 : *std::max_element(latencies_ms.begin(), latencies_ms.end())},
          {"hot_path_drops", drops},
          {"planner_jitter_ms", jitter_ms}};
}

/// What the publisher of Cyclone DDS's own ddsperf makes arrive, on loopback as ours does: the
/// median of its subscriber's seconds.
Figures ddsperf_goodput(std::int64_t message_bytes, double seconds) {
  const auto children_cpu_s = [] {
    rusage usage{};
    getrusage(RUSAGE_CHILDREN, &usage);
    const auto s = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
    };
    return s(usage.ru_utime) + s(usage.ru_stime);
  };
  const double cpu_before_s = children_cpu_s();
  const TimePoint start = Clock::steady().now();
  rt::keep_ddsperf_on_loopback();
  std::vector<double> mb_s;
  double received = 0, lost = 0;
  rt::for_each_line(
      fmt::format(
          "ddsperf -i {0} -D {1} pub size {2} >/dev/null & ddsperf -i {0} -D {1} -1 sub; wait",
          100 + getpid() % 100, seconds + 1, message_bytes),
      [&](const std::string& line) {
        double rate_mbit_s = 0;
        const std::size_t size = line.find("size ");
        if (size != line.npos &&
            std::sscanf(line.c_str() + size,
                        "size %*d total %lf lost %lf delta %*d lost %*d rate %*f kS/s %lf Mb/s",
                        &received, &lost, &rate_mbit_s) == 3) {
          mb_s.push_back(rate_mbit_s / 8);
        }
      });
  if (mb_s.empty()) throw Error("ddsperf has received nothing");
  const double wall_s = rt::us(Clock::steady().now() - start) / 1e6;
  return {{{"goodput_mb_s", rt::median(mb_s)},
           {"cpu_percent", 100 * (children_cpu_s() - cpu_before_s) / wall_s},
           {"received", received},
           {"lost", lost}},
          {}};
}

/// The system as a file that `takt run` can read; removed at the end.
class SystemFile {
 public:
  explicit SystemFile(const std::string& system) {
    if (system.find('\n') == std::string::npos) {
      path_ = system;
      return;
    }
    path_ = fs::temp_directory_path() / fmt::format("takt_bench_{}.yaml", getpid());
    is_ours_ = true;
    std::ofstream file(path_);
    if (!(file << system).flush()) throw not_written("a system", path_);
  }
  ~SystemFile() {
    std::error_code ignored;
    if (is_ours_) fs::remove(path_, ignored);
  }
  SystemFile(const SystemFile&) = delete;
  SystemFile& operator=(const SystemFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  bool is_ours_ = false;
};

std::string trace_path() {
  return fs::temp_directory_path() / fmt::format("takt_bench_{}.trace.json", getpid());
}

json read_and_remove(const std::string& path) {
  json document = json::parse(std::ifstream(path));
  fs::remove(path);
  return document;
}

Figures run_takt(const Variant& variant, const Options& options, const EndSignals& signals) {
  const SystemFile file(variant.system);
  std::vector<std::string> words =
      joined({"run", file.path(), "--duration", options.duration, "--json", "-", "--histograms"},
             variant.words);
  const std::string trace = trace_path();
  if (variant.is_reference_system) words = joined(words, {"--trace", trace});
  Figures figures = figures_of(run_again(words, signals).at("runs").at(0), variant);
  if (variant.is_reference_system) figures.values.merge(key_figures(read_and_remove(trace)));
  return figures;
}

json spread(std::vector<double> values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const json range{{"min", *least}, {"max", *most}};
  json result{{"median", rt::median(values)}, {"n", values.size()}};
  result.update(range);
  return result;
}

/// All runs of all experiments.
struct Course {
  const EndSignals& signals;
  std::size_t done = 0, total = 0;
  std::string interrupted;  // why it ends before its end; empty: it does not
};

Figures measure(const Variant& variant, const Options& options, const EndSignals& signals) {
  if (!variant.is_ddsperf) return run_takt(variant, options, signals);
  Figures figures =
      ddsperf_goodput(variant.message_bytes, rt::us(parse_run_time(options.duration)) / 1e6);
  if (const int signal = signals.take(); signal != 0) {
    throw Interrupted(name_of_signal(signal) + " came");
  }
  return figures;
}

/// What one variant has shown in all its runs.
struct Measured {
  std::map<std::string, std::vector<double>> values;  // by metric
  Histogram latency;
};

/// Runs all variants in turn, as often as asked, or until a signal comes.
std::vector<Measured> run_all(const Experiment& experiment, const std::vector<Variant>& variants,
                              const Options& options, Course& course) {
  std::vector<Measured> measured(variants.size());
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  try {
    for (int repeat = 0; repeat < options.repeat; ++repeat) {
      for (std::size_t i = 0; i < variants.size(); ++i) {
        const Variant& variant = variants[i];
        if (!variant.missing.empty()) continue;
        if (shows_progress) {
          rt::to_stderr("\r\033[K{} of {}: {}, {} {}", course.done + 1, course.total,
                        experiment.name, variant.series,
                        experiment.x_label.empty() ? "" : fmt::format("{}", variant.x));
        }
        const Figures figures = measure(variant, options, course.signals);
        for (const auto& [metric, value] : figures.values) {
          measured[i].values[metric].push_back(value);
        }
        measured[i].latency.merge(figures.latency);
        ++course.done;
      }
    }
  } catch (const Interrupted& interruption) {
    course.interrupted = fmt::format("{} when {} of {} runs were complete", interruption.what(),
                                     course.done, course.total);
  }
  if (shows_progress) rt::to_stderr("\r\033[K");
  return measured;
}

/// Every figure with its spread.
json run(const Experiment& experiment, const Options& options, Course& course) {
  const std::vector<Variant> variants = experiment.variants(options);
  const std::vector<Measured> measured = run_all(experiment, variants, options, course);
  json rows = json::array();
  for (std::size_t i = 0; i < variants.size(); ++i) {
    json row{{"series", variants[i].series}};
    if (measured[i].values.empty()) row["missing"] = "interrupted before its first run";
    if (!variants[i].missing.empty()) row["missing"] = variants[i].missing;
    if (row.contains("missing")) {
      rows.push_back(std::move(row));
      continue;
    }
    if (!experiment.x_label.empty()) row["x"] = variants[i].x;
    for (const auto& [metric, of_runs] : measured[i].values) {
      row["metrics"][metric] = spread(of_runs);
    }
    json buckets = json::array();
    measured[i].latency.for_each_bucket([&](std::size_t, Nanoseconds limit, std::uint64_t count) {
      buckets.push_back({rt::us(limit), count});
    });
    row["latency_buckets_us"] = std::move(buckets);
    rows.push_back(std::move(row));
  }
  return {{"name", experiment.name},       {"title", experiment.title},
          {"x_label", experiment.x_label}, {"metrics", experiment.metrics},
          {"duration", options.duration},  {"repeat", options.repeat},
          {"rows", std::move(rows)}};
}

void print(const json& experiment) {
  std::vector<std::string> header{"series"};
  const bool has_x = !experiment.at("x_label").get<std::string>().empty();
  if (has_x) header.push_back(experiment.at("x_label"));
  for (const json& metric : experiment.at("metrics")) {
    header.push_back(metric);
    header.push_back("spread");
  }
  header.emplace_back("received");
  header.emplace_back("lost");
  Table table(header);
  for (const json& row : experiment.at("rows")) {
    std::vector<std::string> cells{row.at("series")};
    if (row.contains("missing")) {
      cells.push_back(row.at("missing"));
      cells.resize(header.size());
      table.add(std::move(cells));
      continue;
    }
    const auto number = [](double value) {
      return fmt::format("{:.{}f}", value, value < 10 ? 2 : value < 1000 ? 1 : 0);
    };
    if (has_x) cells.push_back(fmt::format("{}", row.at("x").get<double>()));
    for (const json& metric : experiment.at("metrics")) {
      const json& value = row.at("metrics").at(metric.get<std::string>());
      cells.push_back(number(value.at("median")));
      cells.push_back(number(value.at("min")) + "–" + number(value.at("max")));
    }
    for (const char* metric : {"received", "lost"}) {
      cells.push_back(
          fmt::format("{:.0f}", row.at("metrics").at(metric).at("median").get<double>()));
    }
    table.add(std::move(cells));
  }
  table.print(fmt::format(
      "{}: {} (medians of {} run(s) of {}, interleaved; latency: mean, publish → "
      "callback)",
      experiment.at("name").get<std::string>(), experiment.at("title").get<std::string>(),
      experiment.at("repeat").get<int>(), experiment.at("duration").get<std::string>()));
}

/// Timers under each executor, beside the bare loop: what `takt latency` prints, for the report.
json jitter(const Options& options, const EndSignals& signals) {
  return run_again({"latency", "-p", "80", "-i", "1000", "-D", options.duration, "--executor",
                    "all", "--early-wake", "50", "-q", "--json", "-"},
                   signals);
}

/// What ran when on the threads of a pool, for the report.
json timeline(const EndSignals& signals) {
  const SystemFile system(publish_subscribe(500'000, 20'000, 5, 500));
  const std::string trace = trace_path();
  run_again({"run", system.path(), "--executor", "multi_threaded", "--duration", "500ms", "--json",
             "-", "--trace", trace},
            signals);
  return read_and_remove(trace);
}

void write(const json& document, const Options& options) {
  if (!options.json.empty()) write_json(document, options.json);
  if (options.report.empty()) return;
  write_json(document, fs::path(options.report) / "results.json");
  write_report(document, fs::path(options.report) / "report.html");
}

void bench(const Options& options) {
  parse_run_time(options.duration);
  check_writable(options.json);
  unsetenv("TAKT_EXECUTOR");
  unsetenv("TAKT_SCHEDULER");
  // Whoever else is on the default domain would be measured, and would answer.
  setenv("ROS_DOMAIN_ID", fmt::format("{}", 100 + getpid() % 100).c_str(), /*overwrite=*/0);
  const fs::path folder = options.report;
  if (!options.report.empty()) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    check_report(folder / "report.html");
  }
  std::vector<const Experiment*> chosen;
  for (const Experiment& experiment : experiments()) {
    const bool is_meant = options.name == "all"
                              ? experiment.name != "topologies" || !options.files.empty()
                              : experiment.name == options.name;
    if (is_meant) chosen.push_back(&experiment);
  }
  const EndSignals signals;
  Course course{.signals = signals};
  for (const Experiment* experiment : chosen) {
    for (const Variant& variant : experiment->variants(options)) {
      if (variant.missing.empty()) course.total += static_cast<std::size_t>(options.repeat);
    }
  }
  json document = result_document(json::array());
  document["paper"] = json::parse(kPaperFigures);
  document["experiments"] = json::array();
  for (const Experiment* experiment : chosen) {
    document["experiments"].push_back(run(*experiment, options, course));
    if (options.json != "-" && course.done != 0) print(document["experiments"].back());
    if (!course.interrupted.empty()) break;
  }
  if (options.name == "all" && !options.report.empty() && course.interrupted.empty()) {
    try {
      document["jitter"] = jitter(options, signals);
      document["timeline"] = timeline(signals);
    } catch (const Interrupted& interruption) {
      course.interrupted =
          fmt::format("{} after the last run, before jitter and timeline", interruption.what());
    }
  }
  signals.let_through();
  if (course.done != 0 || course.interrupted.empty()) write(document, options);
  if (!course.interrupted.empty()) throw std::runtime_error(course.interrupted);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  std::vector<std::string> names{"all"};
  for (const Experiment& experiment : experiments()) names.push_back(experiment.name);
  command->add_option("NAME", options->name, fmt::format("{}", fmt::join(names, ", ")))
      ->required()
      ->check(CLI::IsMember(names));
  command->add_option("FILE", options->files, "For topologies: the systems to run");
  command->add_option("--duration", options->duration, "Of each run (2s)");
  command->add_option("--repeat", options->repeat, "Runs of each variant (3)")
      ->check(CLI::Range(1, 1000));
  command->add_option("--report", options->report,
                      "Write report.html and results.json into this folder");
  command->add_option("--json", options->json, "Write the figures as JSON too; - for stdout");
  command->footer("Example:\n  takt bench latency --repeat 5 --report bench_report\n");
  command->callback([options] { bench(*options); });
}
const Command registered("bench",
                         "The experiments of the paper on node composition, and its robots",
                         set_up);

}  // namespace
}  // namespace takt::tools
