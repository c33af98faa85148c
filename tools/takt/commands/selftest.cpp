// takt selftest: the figures that takt shows, against what the same run shows by other means.
// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "takt/base/clock.hpp"
#include "takt/base/histogram.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/base/time.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/live_line.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"
#include "run/trace.hpp"
#include "selftest/findings.hpp"
#include "table.hpp"

namespace takt::tools::selftest_command {
namespace {

using nlohmann::json;

/// The trace of a thread holds the executions of so long.
constexpr auto kLongestRun = std::chrono::seconds(20);

struct Options {
  std::string executors = "all", transports = "intra,dds,shm", duration = "1s", json;
};

/// The system: one component that keeps its own books. Its process meets no other, whatever else
/// runs on this machine: it counts each message.
class System {
 public:
  explicit System(const std::string& transport) {
    write_output(
        path_,
        fmt::format(
            "# {}\ndds: {{domain: {}, discovery: off, parameter_services: false, rosout: false}}\n"
            "{}container:\n  name: selftest\n  components:\n"
            "    - component: takt::tools::Stamps\n      name: stamps\n"
            "      parameters: {{file: \"{}\", work_us: 500}}\n",
            kTaktsText, 20 + getpid() % 80,
            transport == "intra"
                ? "chains: [{name: exchange, path: [stamps/small_timer, stamps/small]}]\n"
                : "",
            books_));
  }
  SelftestRun run(const std::string& executor, const std::string& transport,
                  const std::string& duration, const EndSignals& signals) const {
    rt::Run run =
        run_once({"run", path_, "--executor", executor, "--transport", transport, "--duration",
                  duration, "--trace", trace_, "--histograms", "--json", "-"},
                 signals);
    return {executor, transport, std::move(run), read_trace(trace_), books()};
  }

 private:
  json books() const {
    std::ifstream file(books_);
    if (!file) throw Error("a run of the self-test has left no books", "see its message above");
    return rt::parse_json(std::string(std::istreambuf_iterator<char>(file), {}));
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "system.yaml", books_ = folder_ / "books.json",
                    trace_ = folder_ / "trace.json";
};

/// What needs no run.
void compare_tools(Findings& findings) {
  using namespace std::chrono_literals;
  findings.push_back({"a reading of the clock, ns", "", "", clock_reading_us() * 1e3, 0, 1000});
  const Nanoseconds before = thread_cpu_time();
  burn_cpu(20ms);
  findings.push_back(
      {"burn_cpu of 20 ms, ms", "", "", 20, rt::us(thread_cpu_time() - before) / 1e3, 0.2});
  Histogram histogram;
  std::vector<double> samples;
  for (std::int64_t ns = 100; ns < 100'000'000; ns += 1 + ns / 97) {
    samples.push_back(static_cast<double>(ns) / 1e3);
    histogram.record(Nanoseconds(ns));
  }
  for (const double fraction : {0.5, 0.99, 0.999}) {
    const double exact = percentile(samples, fraction);
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

struct Outcome {
  Findings findings;
  std::vector<std::string> notes;
  std::size_t failed = 0;  // runs
};

/// A run that fails does not take along what the others have found.
void measure(const Options& options, const std::string& executor, const std::string& transport,
             const EndSignals& signals, Outcome& outcome) {
  Findings findings;
  try {
    const System system(transport);
    const SelftestRun run = system.run(executor, transport, options.duration, signals);
    if (const std::size_t discarded = compare(run, findings); discarded != 0) {
      outcome.notes.push_back(fmt::format(
          "{}, {}: {} pairs of readings were discarded, as the thread was preempted in between",
          executor, transport, discarded));
    }
  } catch (const Error& error) {
    ++outcome.failed;
    outcome.notes.push_back(fmt::format("{}, {}: {}", executor, transport, error.what()));
    return;
  }
  std::move(findings.begin(), findings.end(), std::back_inserter(outcome.findings));
}

Outcome measure(const Options& options) {
  const EndSignals signals;
  Outcome outcome;
  compare_tools(outcome.findings);
  const std::vector<std::string> names = executors_of(options);
  std::vector<std::string> transports;
  for (const std::string& transport : CLI::detail::split(options.transports, ',')) {
    if (transport == "shm" && !RoudiProcess::is_installed()) {
      outcome.notes.emplace_back("shared memory is not tested: iox-roudi is not installed");
    } else {
      transports.push_back(transport);
    }
  }
  LiveLine line("testing");
  std::size_t done = 0;
  for (const std::string& transport : transports) {
    for (const std::string& name : names) {
      line.step(fmt::format("{}, {}", name, transport), done++, names.size() * transports.size(),
                parse_run_time(options.duration));
      measure(options, name, transport, signals, outcome);
    }
  }
  return outcome;
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
  if (parse_run_time(options.duration) > kLongestRun) {
    throw Error("a run of the self-test lasts 20 s at most, as each message is compared",
                "run it again for more");
  }
  begin_work();
  const auto [findings, notes, failed] = measure(options);
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
    json document = rt::result_document({});
    document.erase("runs");
    document["findings"] = std::move(rows);
    document["notes"] = notes;
    write_json(document, options.json);
  }
  if (options.json != "-") {
    print(findings, notes);
    rt::flush_output();
  }
  require_right(findings, failed);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option("--executors", options->executors, "A list: events,isolated (default: all)");
  command
      ->add_option("--transports", options->transports,
                   "A list of intra, dds and shm (default: all three)")
      ->check([](const std::string& list) {
        for (const std::string& transport : CLI::detail::split(list, ',')) {
          if (transport != "intra" && transport != "dds" && transport != "shm") {
            return fmt::format("'{}' is none of its words; {}", transport,
                               suggest(transport, std::vector<std::string>{"intra", "dds", "shm"}));
          }
        }
        return std::string();
      });
  time_text(
      command->add_option("--duration", options->duration, "Duration of each run (default: 1s)"));
  add_output(*command, "--json", options->json, "Also write the findings as JSON; - for stdout");
  command->footer("Example:\n  takt selftest --executors events,multi_threaded\n");
  command->callback([options] { selftest(*options); });
}
const Command registered(
    "selftest",
    "Compares the figures that takt shows with independent measurements, on this machine", set_up);

}  // namespace
}  // namespace takt::tools::selftest_command
