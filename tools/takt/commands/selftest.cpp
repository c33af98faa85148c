// takt selftest: the figures that takt shows, against what the same run shows by other means.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "takt/base/clock.hpp"
#include "takt/base/histogram.hpp"
#include "takt/base/temporary.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

#include "commands.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"
#include "table.hpp"

namespace takt::tools::selftest_command {
namespace {

using nlohmann::json;

struct Options {
  std::string executors = "all", transports = "intra,dds,shm", duration = "1s", json;
};

/// One figure, by takt and by other means.
struct Finding {
  std::string figure, executor, transport;
  double shown = 0, independent = 0;
  double limit = 0;  // of the difference, in the unit of the figure
  bool is_right() const { return std::abs(shown - independent) <= limit; }
};
using Findings = std::vector<Finding>;

/// The system: one component that keeps its own books.
class System {
 public:
  System() {
    std::ofstream file(path_);
    file << "container:\n  name: selftest\n  components:\n"
            "    - component: takt::tools::Stamps\n      name: stamps\n"
         << fmt::format("      parameters: {{file: \"{}\", work_us: 500}}\n", books_);
    if (!file.flush()) throw not_written("a system", path_);
  }
  std::string path() const { return path_; }
  json books() const {
    std::ifstream file(books_);
    if (!file) throw Error("a run of the self-test has left no books", "see its message above");
    return json::parse(file);
  }

 private:
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "system.yaml", books_ = folder_ / "books.json";
};

const json& callback_of(const json& run, const char* name) {
  for (const json& callback : run.at("callbacks")) {
    if (callback.at("callback") == name) return callback;
  }
  throw Error(fmt::format("a run of the self-test shows no callback '{}'", name));
}

/// The value that so many of the sorted values do not exceed.
double at(const std::vector<std::int64_t>& sorted_ns, double fraction) {
  const auto rank =
      static_cast<std::size_t>(std::ceil(fraction * static_cast<double>(sorted_ns.size())));
  return static_cast<double>(sorted_ns[std::max<std::size_t>(rank, 1) - 1]) / 1e3;
}

/// The mean cost of a reading of the clock.
double clock_reading_us() {
  static const double us = [] {
    constexpr int kReadings = 100'000;
    const TimePoint start = Clock::steady().now();
    TimePoint last{};
    for (int i = 0; i < kReadings; ++i) last = Clock::steady().now();
    return rt::us(last - start) / kReadings;
  }();
  return us;
}

/// A twentieth, as a bucket is 3.2 % wide; or 1.5 µs, on slow machines sixty readings of the clock,
/// for the code between the component's readings and Takt's, which on a busy machine is in no
/// cache.
double latency_limit(double us) {
  return std::max({0.05 * us, 1.5, 60 * clock_reading_us()});
}

void compare_topic(const json& run, const json& books, const char* topic, const Finding& where,
                   Findings& findings) {
  const json& callback = callback_of(run, topic);
  auto latencies = books.at(topic).at("latencies_ns").get<std::vector<std::int64_t>>();
  if (latencies.empty()) throw Error(fmt::format("no message of '{}' has come", topic));
  std::sort(latencies.begin(), latencies.end());
  const auto add = [&](const std::string& figure, double shown, double independent, double limit) {
    Finding finding = where;
    finding.figure = fmt::format("{}: {}", topic, figure);
    finding.shown = shown;
    finding.independent = independent;
    finding.limit = limit;
    findings.push_back(std::move(finding));
  };
  const json& shown = callback.at("latency_us");
  // No higher ones, and no mean: where the thread is preempted between two readings of the clock,
  // one of both sides counts milliseconds that the other does not.
  const double p25 = at(latencies, 0.25), p50 = at(latencies, 0.5);
  const Histogram histogram = read_histogram(shown);
  add("latency p25, µs", rt::us(histogram.percentile(0.25)), p25, latency_limit(p25));
  add("latency p50, µs", shown.at("p50"), p50, latency_limit(p50));
  const double parts = callback.at("waiting_us").at("sum").get<double>() +
                       callback.at("take_us").at("sum").get<double>();
  // Negative times, from a clock that is not quite the sender's, count as 0 in each part.
  add("waiting + take, ms in all", parts / 1e3, shown.at("sum").get<double>() / 1e3,
      1e-3 + 1e-6 * parts);
  const auto received = static_cast<double>(latencies.size());
  add("received", callback.at("received"), received, 0);
  add("sent", callback.at("expected"), books.at(topic).at("sent"), 0);
}

/// The thread of an executor that has one.
void compare_thread(const json& run, const json& books, const Finding& where, Findings& findings) {
  const json* thread = nullptr;
  for (const json& candidate : run.at("threads")) {
    if (candidate.at("executor") == "dds") continue;
    if (thread != nullptr) return;  // several: the component has seen one
    thread = &candidate;
  }
  if (thread == nullptr) return;
  const double seconds = books.at("seconds");
  if (seconds <= 0) return;
  Finding cpu = where, wakeups = where;
  cpu.figure = "thread's CPU, %";
  cpu.shown = thread->at("cpu_percent");
  cpu.independent = 100 * books.at("cpu_s").get<double>() / seconds;
  // The thread is counted for the whole spin, the component counts between its first and last tick.
  cpu.limit = std::max(0.15 * cpu.independent, 1.0);
  findings.push_back(cpu);
  wakeups.figure = "thread's wake-ups, 1/s";
  wakeups.shown = thread->at("wakeups").get<double>() / run.at("duration_s").get<double>();
  wakeups.independent = books.at("wakeups").get<double>() / seconds;
  wakeups.limit = std::max(0.1 * wakeups.independent, 50.0);
  findings.push_back(wakeups);
}

/// The process by getrusage, its threads one by one: executors' and Cyclone's.
void compare_process(const json& run, const Finding& where, Findings& findings) {
  Finding sum = where;
  sum.figure = "threads' CPU together, %";
  for (const json& thread : run.at("threads")) sum.shown += thread.at("cpu_percent").get<double>();
  for (const json& process : run.at("processes")) {
    if (process.at("name") == "selftest") sum.independent = process.at("cpu_percent");
  }
  sum.limit = std::max(0.05 * sum.independent, 0.5);
  findings.push_back(sum);
}

/// What needs no run.
void compare_tools(Findings& findings) {
  using namespace std::chrono_literals;
  findings.push_back({"a reading of the clock, ns", "", "", clock_reading_us() * 1e3, 0, 1000});
  const Nanoseconds before = thread_cpu_time();
  burn_cpu(20ms);
  findings.push_back(
      {"burn_cpu of 20 ms, ms", "", "", 20, rt::us(thread_cpu_time() - before) / 1e3, 0.2});
  Histogram histogram;
  std::vector<std::int64_t> samples_ns;
  for (std::int64_t ns = 100; ns < 100'000'000; ns += 1 + ns / 97) {
    samples_ns.push_back(ns);
    histogram.record(Nanoseconds(ns));
  }
  for (const double fraction : {0.5, 0.99, 0.999}) {
    const double exact = at(samples_ns, fraction);
    findings.push_back({fmt::format("histogram, percentile {}, µs", fraction * 100), "", "",
                        rt::us(histogram.percentile(fraction)), exact, 0.033 * exact});
  }
}

std::vector<std::string> executors_of(const Options& options) {
  if (options.executors == "all") return executors().names();
  std::vector<std::string> names = CLI::detail::split(options.executors, ',');
  for (const std::string& name : names) executors().check(name);
  return names;
}

Findings measure(const Options& options, std::vector<std::string>& notes) {
  const EndSignals signals;
  const System system;
  Findings findings;
  compare_tools(findings);
  const std::vector<std::string> names = executors_of(options);
  std::vector<std::string> transports;
  for (const std::string& transport : CLI::detail::split(options.transports, ',')) {
    if (transport == "shm" && !RoudiProcess::is_installed()) {
      notes.emplace_back("shared memory is not tested: iox-roudi is not installed");
    } else {
      transports.push_back(transport);
    }
  }
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  std::size_t done = 0;
  for (const std::string& transport : transports) {
    for (const std::string& name : names) {
      if (shows_progress) {
        rt::clear_line();
        rt::to_stderr("{} of {}: {}, {}", ++done, names.size() * transports.size(), name,
                      transport);
      }
      const json run =
          run_again({"run", system.path(), "--executor", name, "--transport", transport,
                     "--duration", options.duration, "--histograms", "--json", "-"},
                    signals)
              .at("runs")
              .at(0);
      const json books = system.books();
      const Finding where{"", name, transport};
      compare_topic(run, books, "small", where, findings);
      compare_topic(run, books, "large", where, findings);
      compare_thread(run, books, where, findings);
      compare_process(run, where, findings);
    }
  }
  if (shows_progress) rt::clear_line();
  return findings;
}

void print(const Findings& findings, const std::vector<std::string>& notes) {
  Table table({"figure", "executor", "transport", "takt", "independent", "error", "limit", ""});
  for (const Finding& finding : findings) {
    const auto number = [](double value) { return fmt::format("{:.2f}", value); };
    table.add({finding.figure, finding.executor, finding.transport, number(finding.shown),
               number(finding.independent), number(finding.shown - finding.independent),
               number(finding.limit), finding.is_right() ? "" : "WRONG"});
  }
  table.print("takt's figures against stamps in messages, raw samples and the kernel's counters");
  for (const std::string& note : notes) rt::print("{}\n", note);
}

void selftest(const Options& options) {
  check_writable(options.json);
  use_own_domain();
  std::vector<std::string> notes;
  const Findings findings = measure(options, notes);
  if (!options.json.empty()) {
    json rows = json::array();
    for (const Finding& finding : findings) {
      rows.push_back({{"figure", finding.figure},
                      {"executor", finding.executor},
                      {"transport", finding.transport},
                      {"takt", finding.shown},
                      {"independent", finding.independent},
                      {"limit", finding.limit},
                      {"is_right", finding.is_right()}});
    }
    json document = result_document(json::array());
    document.erase("runs");
    document["findings"] = std::move(rows);
    document["notes"] = notes;
    write_json(document, options.json);
  }
  if (options.json != "-") {
    print(findings, notes);
    rt::flush_output();
  }
  const auto wrong = std::count_if(findings.begin(), findings.end(),
                                   [](const Finding& finding) { return !finding.is_right(); });
  if (wrong != 0) {
    throw std::runtime_error(fmt::format(
        "{} of {} figures differ from what was measured independently by more than their limit",
        wrong, findings.size()));
  }
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option("--executors", options->executors, "all, or a list: events,isolated");
  command->add_option("--transports", options->transports, "A list of intra, dds and shm")
      ->check([](const std::string& list) {
        for (const std::string& transport : CLI::detail::split(list, ',')) {
          if (transport != "intra" && transport != "dds" && transport != "shm") {
            return fmt::format("'{}' is none of intra, dds, shm", transport);
          }
        }
        return std::string();
      });
  command->add_option("--duration", options->duration, "Duration of each run (1s)");
  command->add_option("--json", options->json, "Also write the findings as JSON; - for stdout");
  command->footer("Example:\n  takt selftest --executors events,multi_threaded\n");
  command->callback([options] { selftest(*options); });
}
const Command registered(
    "selftest",
    "Compares the figures that takt shows with independent measurements, on this machine", set_up);

}  // namespace
}  // namespace takt::tools::selftest_command
