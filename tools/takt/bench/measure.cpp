// SPDX-License-Identifier: Apache-2.0
#include "bench/measure.hpp"

#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "takt/base/output_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/base/time.hpp"
#include "takt/measuring/ddsperf.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "bench/reference_system.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// Throughput of Cyclone DDS's ddsperf on loopback, for comparison: the median of the values that
/// its subscriber prints every second.
Figures ddsperf_goodput(std::int64_t message_bytes, double seconds, const EndSignals& signals) {
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
      },
      signals.fd());
  if (const int signal = signals.take(); signal != 0) {
    throw Interrupted(signal, "");
  }
  if (mb_s.empty()) throw Error("ddsperf received nothing");
  const double wall_s = rt::us(Clock::steady().now() - start) / 1e6;
  return {{{"goodput_mb_s", rt::median(mb_s)},
           {"cpu_percent", 100 * (children_cpu_s() - cpu_before_s) / wall_s},
           {"received", received},
           {"lost", lost}},
          {}};
}

/// A temporary file with the system, for `takt run`.
class SystemFile {
 public:
  explicit SystemFile(const std::string& system) {
    if (system.find('\n') == std::string::npos) {
      path_ = system;
      return;
    }
    path_ = folder_.emplace() / "system.yaml";
    write_output(path_, fmt::format("# {}\n{}", kTaktsText, system));
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::optional<TemporaryFolder> folder_;  // nullopt: the file is the user's
};

/// Where `takt run` writes a timeline.
class TraceFile {
 public:
  const std::string& path() const { return path_; }
  json read() const {
    std::ifstream file(path_);
    return rt::parse_json(std::string(std::istreambuf_iterator<char>(file), {}));
  }

 private:
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "trace.json";
};

/// So many scenarios make one repeat: their phases differ, and each is a hundred times faster than
/// time.
constexpr int kScenarios = 20;

/// The means of them.
Figures run_simulation(const Variant& variant, const BenchOptions& options, int repeat,
                       const EndSignals& signals) {
  const SystemFile file(variant.system);
  const std::vector<std::string> words{"simulate",    file.path(),
                                       "--duration",  options.duration,
                                       "--runs",      std::to_string(kScenarios),
                                       "--seed",      std::to_string(repeat * kScenarios + 1),
                                       "--phases",    "random",
                                       "--times",     "worst",
                                       "--json",      "-",
                                       "--histograms"};
  const json result = run_again(joined(words, variant.words), signals, /*is_quiet=*/true);
  Figures mean;
  for (const rt::Run& run : rt::read_runs(result, "")) {
    const Figures figures = figures_of(run, variant);
    for (const auto& [metric, value] : figures.values) mean.values[metric] += value / kScenarios;
    mean.latency.merge(figures.latency);
  }
  return mean;
}

Figures run_takt(const Variant& variant, const BenchOptions& options, const EndSignals& signals) {
  const SystemFile file(variant.system);
  std::vector<std::string> words =
      joined({"run", file.path(), "--duration", options.duration, "--json", "-", "--histograms"},
             variant.words);
  const TraceFile trace;
  if (variant.is_reference_system) words = joined(words, {"--trace", trace.path()});
  const rt::Run run = run_once(words, signals);
  Figures figures = figures_of(run, variant);
  if (variant.is_reference_system) figures.values.merge(reference_figures(run, trace.read()));
  return figures;
}

}  // namespace

Figures measure(const Variant& variant, const BenchOptions& options, int repeat,
                const EndSignals& signals) {
  if (variant.is_simulated) return run_simulation(variant, options, repeat, signals);
  if (!variant.is_ddsperf) return run_takt(variant, options, signals);
  return ddsperf_goodput(variant.message_bytes, rt::us(parse_run_time(options.duration)) / 1e6,
                         signals);
}

json jitter(const BenchOptions& options, const EndSignals& signals) {
  return run_again({"latency", "-p", "80", "-i", "1000", "-D", options.duration, "--executor",
                    "all", "--early-wake", "50us", "-q", "--json", "-"},
                   signals);
}

json timeline(const EndSignals& signals) {
  const SystemFile system(publish_subscribe(500'000, 20'000, 5, 500));
  const TraceFile trace;
  run_again({"run", system.path(), "--executor", "multi_threaded", "--duration", "500ms", "--json",
             "-", "--trace", trace.path()},
            signals);
  return trace.read();
}

}  // namespace takt::tools
