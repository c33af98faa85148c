// takt latency: measures wake-up latency as cyclictest does, of the bare system call and of
// executors in turn.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <csignal>
#include <ctime>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "takt/base/time.hpp"
#include "takt/base/version.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/cyclic.hpp"
#include "takt/measuring/load.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/output.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"
#include "takt/sched/threads/memory_lock.hpp"

#include "commands.hpp"
#include "run/result_json.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr std::uint64_t kRounds = 10;
constexpr Nanoseconds kGapSearch = 100ms;  // in each round

struct Options {
  int priority = 0;
  std::int64_t interval_us = 1000, early_wake_us = 0, break_us = 0;
  std::uint64_t loops = 0;
  std::size_t histogram = 0;
  std::string duration, executors = "events", affinity, policy, load = "none", histogram_file, json;
  int dma_latency_us = 0;
  bool quiet = false, nanoseconds = false, leaves_dma_latency = false, require = false;
};

std::atomic<bool> stop{false};

using Rows = std::vector<std::unique_ptr<rt::CyclicVariant>>;

struct Outcome {
  rt::Gaps gaps;
  rt::Observation::Result observation;
  std::vector<std::string> notes;
  std::time_t start = 0, end = 0;
};

std::string command_line() {
  std::ifstream file("/proc/self/cmdline");
  std::string line;
  for (std::string word; std::getline(file, word, '\0');) {
    if (!line.empty()) line += ' ';
    line += word;
  }
  return line;
}

rt::CyclicOptions cyclic_options(const Options& options) {
  rt::CyclicOptions cyclic;
  cyclic.thread.name = "latency";
  cyclic.thread.priority = options.priority;
  if (!options.policy.empty()) {
    cyclic.thread.policy = thread_policy(options.policy);
  } else if (options.priority > 0) {
    cyclic.thread.policy = ThreadPolicy::fifo;
  }
  for (const std::string& cpu : CLI::detail::split(options.affinity, ',')) {
    if (cpu.empty()) continue;
    if (cpu.find_first_not_of("0123456789") != std::string::npos || cpu.size() > 4) {
      throw Error(fmt::format("-a {}: '{}' is no CPU", options.affinity, cpu),
                  fmt::format("use one or several of {}", fmt::join(available_cpus(), ",")));
    }
    cyclic.thread.affinity.push_back(std::stoi(cpu));
  }
  cyclic.thread.check();
  cyclic.realtime = options.require ? Realtime::require : Realtime::prefer;
  cyclic.interval = std::chrono::microseconds(options.interval_us);
  if (options.nanoseconds) cyclic.bin = 1ns;
  if (options.histogram != 0) cyclic.bins = options.histogram;
  cyclic.break_above = options.nanoseconds ? Nanoseconds(options.break_us)
                                           : std::chrono::microseconds(options.break_us);
  return cyclic;
}

std::int64_t in_unit(Nanoseconds duration, const rt::CyclicOptions& cyclic) {
  return duration / cyclic.bin;
}

/// cyclictest's summary, one line per thread. Takt's rows alternate in time; each is one line.
void print_summary(const Rows& rows, const rt::CyclicOptions& cyclic, std::FILE* file) {
  int number = 0;
  for (const auto& row : rows) {
    const rt::CyclicResult& result = row->result();
    const bool empty = result.cycles == 0;
    fmt::print(file, "T:{:2} ({:5}) P:{:2} I:{} C:{:7} Min:{:7} Act:{:5} Avg:{:5} Max:{:8}\n",
               number++, result.in_force.tid, result.in_force.priority, cyclic.interval / 1us,
               result.cycles, empty ? 0 : in_unit(result.min, cyclic), in_unit(result.last, cyclic),
               in_unit(result.mean(), cyclic), empty ? 0 : in_unit(result.max, cyclic));
  }
}

std::string each(const Rows& rows, const std::function<std::string(const rt::CyclicResult&)>& get) {
  std::string line;
  for (const auto& row : rows) (line += ' ') += get(row->result());
  return line;
}

/// cyclictest's histogram: one line per µs, one column per row.
void print_histogram(const Rows& rows, const rt::CyclicOptions& cyclic, std::FILE* file) {
  fmt::print(file, "# Histogram\n");
  for (std::size_t bin = 0; bin < cyclic.bins; ++bin) {
    fmt::print(file, "{:06}", bin);
    for (const auto& row : rows) fmt::print(file, " {:06}", row->result().bins[bin]);
    fmt::print(file, "\n");
  }
  const auto in_five = [&](Nanoseconds rt::CyclicResult::*member) {
    return each(rows, [&](const auto& result) {
      return fmt::format("{:05}", in_unit(result.*member, cyclic));
    });
  };
  fmt::print(file, "# Total:{}\n",
             each(rows, [](const auto& result) { return fmt::format("{:09}", result.cycles); }));
  fmt::print(file, "# Min Latencies:{}\n", in_five(&rt::CyclicResult::min));
  fmt::print(file, "# Avg Latencies:{}\n", each(rows, [&](const auto& result) {
               return fmt::format("{:05}", in_unit(result.mean(), cyclic));
             }));
  fmt::print(file, "# Max Latencies:{}\n", in_five(&rt::CyclicResult::max));
  fmt::print(file, "# Histogram Overflows:{}\n",
             each(rows, [](const auto& result) { return fmt::format("{:05}", result.overflows); }));
  fmt::print(file, "# Histogram Overflow at cycle number:\n");
  int number = 0;
  for (const auto& row : rows) {
    fmt::print(file, "# Thread {}: {}\n", number++, fmt::join(row->result().overflow_cycles, " "));
  }
}

/// Results that cyclictest does not have. Scripts for its output skip lines that begin with '#'.
void print_details(const Rows& rows, const rt::CyclicOptions& cyclic, const Outcome& outcome) {
  fmt::print("#\n# {:<3}{:<40}{:>9}{:>9}{:>9}{:>9}{:>9}{:>7}{:>7}{:>8}{:>7}  {}\n", "T", "in µs",
             "p50", "p99", "p99.9", "p50/T0", "p99/T0", "early", "missed", "cpu_%", "faults",
             "in force");
  const rt::CyclicResult& bare = rows.front()->result();
  int number = 0;
  for (const auto& row : rows) {
    const rt::CyclicResult& result = row->result();
    const auto ratio = [](double value, double of_bare) {
      return of_bare == 0 ? 0 : value / of_bare;
    };
    fmt::print("# {:<3}{:<40}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}{:>7}{:>7}{:>8.2f}{:>7}  {}\n",
               number++, result.name, result.rounds.p50(), result.rounds.p99(),
               rt::us(result.rounds.all.percentile(0.999)),
               ratio(result.rounds.p50(), bare.rounds.p50()),
               ratio(result.rounds.p99(), bare.rounds.p99()), result.early, result.missed,
               result.cpu_percent(), result.counters.minor_faults + result.counters.major_faults,
               fmt::format("{} {} on {}", to_string(result.in_force.policy),
                           result.in_force.priority, fmt::join(result.in_force.affinity, ",")));
  }
  fmt::print("# p50, p99: medians of {} rounds, in which the rows alternate\n",
             bare.rounds.p50_us.size());
  fmt::print("# {}\n", rt::machine_line());
  fmt::print(
      "# a thread that only read the clock missed {} spans over {} µs in {:.1f} s: longest "
      "{:.0f} µs, {:.2f} % of the time\n",
      outcome.gaps.count, rt::Gaps::kThreshold / 1us, rt::us(outcome.gaps.observed) / 1e6,
      rt::us(outcome.gaps.longest),
      outcome.gaps.observed == 0ns
          ? 0.0
          : 100 * rt::us(outcome.gaps.total) / rt::us(outcome.gaps.observed));
  fmt::print("# stolen by the host: {:.2f} %\n", outcome.observation.steal_percent);
  for (const rt::Neighbour& neighbour : outcome.observation.neighbours) {
    fmt::print("# another real-time thread ran for {:.1f} ms: {} ({}, {} {}) on {}\n",
               rt::us(neighbour.cpu_time) / 1e3, neighbour.name, neighbour.thread, neighbour.policy,
               neighbour.priority, fmt::join(neighbour.affinity, ","));
  }
  for (const std::string& note : outcome.notes) fmt::print("# {}\n", note);
  if (cyclic.break_above != 0ns) {
    for (const auto& row : rows) {
      if (row->result().broke) {
        fmt::print("# Break thread: {}\n# Break value: {}\n", row->result().in_force.tid,
                   in_unit(row->result().max, cyclic));
      }
    }
  }
}

json thread_json(const rt::CyclicResult& result, const rt::CyclicOptions& cyclic) {
  json histogram = json::object();
  for (std::size_t bin = 0; bin < result.bins.size(); ++bin) {
    if (result.bins[bin] != 0) histogram[std::to_string(bin)] = result.bins[bin];
  }
  const bool empty = result.cycles == 0;
  return {{"histogram", std::move(histogram)},
          {"cycles", result.cycles},
          {"min", empty ? 0 : in_unit(result.min, cyclic)},
          {"max", empty ? 0 : in_unit(result.max, cyclic)},
          {"avg", empty ? 0
                        : static_cast<double>(result.mean().count()) /
                              static_cast<double>(cyclic.bin.count())},
          {"cpu", result.in_force.affinity.empty() ? 0 : result.in_force.affinity.front()},
          {"node", 0},
          {"name", result.name},
          {"p50_us", result.rounds.p50()},
          {"p99_us", result.rounds.p99()},
          {"p999_us", rt::us(result.rounds.all.percentile(0.999))},
          {"round_p50_us", result.rounds.p50_us},
          {"round_p99_us", result.rounds.p99_us},
          {"overflows", result.overflows},
          {"early", result.early},
          {"missed", result.missed},
          {"cpu_percent", result.cpu_percent()},
          {"page_faults", result.counters.minor_faults + result.counters.major_faults},
          {"asked",
           {{"policy", std::string(to_string(cyclic.thread.policy))},
            {"priority", cyclic.thread.priority},
            {"affinity", cyclic.thread.affinity}}},
          {"in_force",
           {{"policy", std::string(to_string(result.in_force.policy))},
            {"priority", result.in_force.priority},
            {"affinity", result.in_force.affinity},
            {"refused", result.in_force.refused}}}};
}

std::string utc(std::time_t value) {
  std::tm parts{};
  gmtime_r(&value, &parts);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S +0000", &parts);
  return text.data();
}

/// The JSON format of rt-tests 2.4, with additional keys.
json to_json(const Rows& rows, const rt::CyclicOptions& cyclic, const Options& options,
             const Outcome& outcome) {
  utsname name{};
  uname(&name);
  json threads = json::object();
  int number = 0;
  for (const auto& row : rows) {
    threads[std::to_string(number++)] = thread_json(row->result(), cyclic);
  }
  return {{"file_version", 1},
          {"cmdline:", command_line()},
          {"rt_test_version:", fmt::format("takt {}", TAKT_VERSION)},
          {"start_time", utc(outcome.start)},
          {"end_time", utc(outcome.end)},
          {"return_code", 0},
          {"sysinfo",
           {{"sysname", name.sysname},
            {"nodename", name.nodename},
            {"release", name.release},
            {"version", name.version},
            {"machine", name.machine},
            {"realtime", rt::preemption_model() == "PREEMPT_RT" ? 1 : 0}}},
          {"num_threads", rows.size()},
          {"resolution_in_ns", cyclic.bin.count()},
          {"thread", std::move(threads)},
          {"load", options.load},
          {"machine", rt::machine_json()},
          {"disturbance", rt::to_json(outcome.observation)},
          {"gaps",
           {{"threshold_us", rt::us(rt::Gaps::kThreshold)},
            {"count", outcome.gaps.count},
            {"longest_us", rt::us(outcome.gaps.longest)},
            {"total_us", rt::us(outcome.gaps.total)},
            {"observed_us", rt::us(outcome.gaps.observed)}}},
          {"notes", outcome.notes}};
}

/// Runs rounds until the number of cycles is reached; without a number, until a signal.
void measure(const Rows& rows, const rt::CyclicOptions& cyclic, std::uint64_t cycles,
             const Options& options, Outcome& outcome) {
  const std::uint64_t a_second = std::max<std::int64_t>(1s / cyclic.interval, 1);
  const std::uint64_t a_round =
      cycles == 0 ? a_second : std::max<std::uint64_t>(cycles / kRounds, 1);
  const bool shows_progress = !options.quiet && isatty(STDERR_FILENO) != 0;
  const rt::Observation observation;
  outcome.start = std::time(nullptr);
  const auto is_done = [&] {
    return stop.load() || std::any_of(rows.begin(), rows.end(),
                                      [](const auto& row) { return row->result().broke; });
  };
  for (std::uint64_t done = 0; !is_done() && (cycles == 0 || done < cycles); done += a_round) {
    rt::find_gaps(cyclic, kGapSearch, outcome.gaps);
    const std::uint64_t now = cycles == 0 ? a_round : std::min(a_round, cycles - done);
    for (const auto& row : rows) {
      if (!is_done()) row->round(now, stop);
    }
    if (shows_progress) {
      print_summary(rows, cyclic, stderr);
      rt::to_stderr("\033[{}A", rows.size());
    }
  }
  if (shows_progress) rt::to_stderr("\033[J");
  outcome.end = std::time(nullptr);
  outcome.observation = observation.so_far();
}

void latency(const Options& options) {
  const rt::CyclicOptions cyclic = cyclic_options(options);
  check_writable(options.json);
  check_writable(options.histogram_file);
  const Nanoseconds early_wake = std::chrono::microseconds(options.early_wake_us);
  Rows rows;
  rows.push_back(rt::bare_loop(cyclic));
  const std::vector<std::string> names =
      options.executors == "all" ? executors().names() : CLI::detail::split(options.executors, ',');
  for (const std::string& name : names) {
    rows.push_back(rt::executor_timer(cyclic, name));
    if (early_wake != 0ns) rows.push_back(rt::executor_timer(cyclic, name, early_wake));
  }
  std::uint64_t cycles = options.loops;
  if (!options.duration.empty()) {
    // A number without a unit is in seconds, as in cyclictest.
    const bool has_unit = options.duration.find_first_not_of("0123456789.") != std::string::npos;
    cycles = std::max<std::int64_t>(
        parse_run_time(options.duration + (has_unit ? "" : "s")) / cyclic.interval, 1);
  }
  Outcome outcome;
  const auto note = [&](const std::string& refused) {
    if (!refused.empty()) outcome.notes.push_back(refused);
  };
  const rt::Load load(options.load);  // start before mlockall: its processes must not inherit it
  note(lock_memory(cyclic.realtime));
  const CpuDmaLatency dma_latency(options.dma_latency_us,
                                  options.leaves_dma_latency ? Realtime::off : cyclic.realtime);
  note(dma_latency.refused());
  const bool has_text = options.json != "-";
  if (has_text && !options.leaves_dma_latency && dma_latency.refused().empty()) {
    fmt::print("# /dev/cpu_dma_latency set to {}us\n", options.dma_latency_us);
  }
  std::signal(SIGINT, [](int) { stop.store(true); });
  std::signal(SIGTERM, [](int) { stop.store(true); });
  measure(rows, cyclic, cycles, options, outcome);
  note(rows.back()->result().in_force.refused);
  if (has_text) {
    print_summary(rows, cyclic, stdout);
    if (options.histogram != 0 && options.histogram_file.empty()) {
      print_histogram(rows, cyclic, stdout);
    }
    print_details(rows, cyclic, outcome);
  }
  if (!options.histogram_file.empty()) {
    std::FILE* file = std::fopen(options.histogram_file.c_str(), "w");
    if (file == nullptr) {
      throw Error("the histogram could not be written", "choose a writable file",
                  options.histogram_file);
    }
    print_histogram(rows, cyclic, file);
    const bool is_written = std::ferror(file) == 0;
    if (std::fclose(file) != 0 || !is_written) {
      throw not_written("the histogram", options.histogram_file);
    }
  }
  if (!options.json.empty()) write_json(to_json(rows, cyclic, options, outcome), options.json);
}

void set_up(CLI::App* command) {
  command->set_help_flag("--help", "Print this help message and exit");
  const auto options = std::make_shared<Options>();
  command->add_option("-p,--priority", options->priority, "SCHED_FIFO priority; 0: SCHED_OTHER")
      ->check(CLI::Range(0, 99));
  command->add_option("--policy", options->policy,
                      "Instead: SCHED_FIFO, SCHED_RR, SCHED_OTHER, SCHED_BATCH or SCHED_IDLE");
  command->add_option("-i,--interval", options->interval_us, "Period in µs (1000)")
      ->check(CLI::Range(20, 10'000'000));
  auto* loops = command->add_option("-l,--loops", options->loops,
                                    "Cycles of each row (default: until Ctrl-C)");
  command
      ->add_option("-D,--duration", options->duration, "Duration of each row, instead of -l: 10s")
      ->excludes(loops);
  command->add_option("-a,--affinity", options->affinity, "CPUs of the measured thread: 1 or 0,1");
  auto* histogram = command
                        ->add_option("-h,--histogram", options->histogram,
                                     "Print a histogram of this many µs after the run")
                        ->check(CLI::Range(1, 1'000'000));
  command->add_option("--histfile", options->histogram_file, "Write the histogram there instead")
      ->needs(histogram);
  command->add_flag_function(
      "-m,--mlockall", [](std::int64_t) {}, "Accepted as in cyclictest; memory is always locked");
  command->add_flag("-q,--quiet", options->quiet, "Print a summary only on exit");
  command->add_flag("-N,--nsecs", options->nanoseconds, "Print in ns instead of µs");
  command
      ->add_option("-b,--breaktrace", options->break_us,
                   "Stop when a latency exceeds this value (µs)")
      ->check(CLI::PositiveNumber);
  command->add_option("--executor", options->executors, "all, or a list: events,single_threaded");
  command
      ->add_option("--early-wake", options->early_wake_us,
                   "Add a row for each executor that wakes up this many µs early")
      ->check(CLI::Range(1, static_cast<int>(kMostEarlyWake / 1us)));
  command->add_option("--load", options->load, "Background load: cpu, io or none")
      ->check(CLI::IsMember(rt::load_names()));
  command
      ->add_option("--cpu-dma-latency", options->dma_latency_us,
                   "Value of /dev/cpu_dma_latency during the run, in µs (0)")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--default-system", options->leaves_dma_latency,
                    "Do not use /dev/cpu_dma_latency");
  command->add_flag("--require", options->require,
                    "Fail if the system refuses real-time privileges");
  command->add_option("--json", options->json, "Write rt-tests' JSON; - for stdout");
  command->footer(
      "Example:\n  takt latency -p 80 -i 1000 -D 10s -a 1 --executor all --early-wake 50\n");
  command->callback([options] { latency(*options); });
}
const Command registered(
    "latency", "Measures wake-up latency as cyclictest does, of executors and of clock_nanosleep",
    set_up);

}  // namespace
}  // namespace takt::tools
