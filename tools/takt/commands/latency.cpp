// takt latency: measures wake-up latency as cyclictest does, of the bare system call and of
// executors in turn.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cctype>
#include <ctime>
#include <span>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/time.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/cyclic.hpp"
#include "takt/measuring/load.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/run.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"
#include "takt/sched/threads/memory_lock.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "latency/cpu_set.hpp"
#include "latency/output.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "report.hpp"
#include "run/end_signals.hpp"
#include "run/live_line.hpp"
#include "run/result_json.hpp"

namespace takt::tools::latency_command {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kRounds = 10;
constexpr Nanoseconds kGapSearch = 100ms;  // in each round

struct Options {
  int priority = 0;
  std::int64_t interval_us = 1000, break_us = 0;
  std::uint64_t loops = 0;
  Nanoseconds early_wake{0};
  std::size_t histogram = 0, histogram_with_sum = 0;
  std::size_t threads = 1;
  std::int64_t distance_us = 500;
  std::string duration, executors, affinity, policy, load = "none", histogram_file, json, report;
  int dma_latency_us = 0;
  bool quiet = false, nanoseconds = false, leaves_dma_latency = false, require = false,
       verbose = false, relative = false, uses_nanosleep = false, marks = false,
       spreads_priority = false;
  int clock = 0;
  std::vector<std::string> notes;  // of options that do nothing
  std::size_t bins() const { return std::max(histogram, histogram_with_sum); }
};

std::atomic<bool> stop{false};  // by a signal, or a latency above -b

/// Our names, and cyclictest's: "fifo".
ThreadPolicy policy_of(std::string name) {
  if (!name.starts_with("SCHED_")) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char letter) { return std::toupper(letter); });
    name.insert(0, "SCHED_");
  }
  return thread_policy(name);
}

rt::CyclicOptions cyclic_options(const Options& options) {
  rt::CyclicOptions cyclic;
  cyclic.thread.name = "latency";
  cyclic.thread.priority = options.priority;
  if (!options.policy.empty()) {
    cyclic.thread.policy = policy_of(options.policy);
  } else if (options.priority > 0) {
    cyclic.thread.policy = ThreadPolicy::fifo;
  }
  cyclic.thread.check();
  cyclic.interval = std::chrono::microseconds(options.interval_us);
  if (options.nanoseconds) cyclic.bin = 1ns;
  if (options.bins() != 0) cyclic.bins = options.bins();
  cyclic.relative = options.relative;
  cyclic.uses_nanosleep = options.uses_nanosleep;
  cyclic.clock = options.clock == 1 ? CLOCK_REALTIME : CLOCK_MONOTONIC;
  cyclic.keeps_values = options.verbose;
  cyclic.break_above = options.nanoseconds ? Nanoseconds(options.break_us)
                                           : std::chrono::microseconds(options.break_us);
  return cyclic;
}

/// As cyclictest's threads: the n-th on the n-th CPU of the set, and, unless there is a histogram,
/// with a longer interval.
std::vector<rt::CyclicOptions> threads_of(const Options& options, const rt::CyclicOptions& first) {
  const std::vector<int> cpus =
      options.affinity.empty() ? std::vector<int>() : parse_cpu_set(options.affinity);
  std::vector<rt::CyclicOptions> threads(options.threads, first);
  for (std::size_t i = 0; i < threads.size(); ++i) {
    if (i != 0) threads[i].thread.name += fmt::format("_{}", i);  // and of its executor's node
    if (options.spreads_priority && first.thread.priority != 0) {
      threads[i].thread.priority = std::max(1, first.thread.priority - static_cast<int>(i));
    }
    if (!cpus.empty()) threads[i].thread.affinity = {cpus[i % cpus.size()]};
    if (options.bins() != 0) continue;
    threads[i].interval +=
        static_cast<std::int64_t>(i) * std::chrono::microseconds(options.distance_us);
  }
  return threads;
}

/// All methods, each with all its threads.
Rows rows_of(const Options& options, const std::vector<rt::CyclicOptions>& threads) {
  Rows rows;
  for (const rt::CyclicOptions& thread : threads) rows.push_back(rt::bare_loop(thread));
  const bool is_cyclictests = options.bins() != 0 && options.early_wake == 0ns;
  const std::string wanted = !options.executors.empty() ? options.executors
                             : is_cyclictests           ? "none"
                                                        : "events";
  if (wanted == "none") return rows;
  const std::vector<std::string> names =
      wanted == "all" ? executors().names() : CLI::detail::split(wanted, ',');
  for (const std::string& name : names) {
    for (const rt::CyclicOptions& thread : threads) {
      rows.push_back(rt::executor_timer(thread, name));
    }
    if (options.early_wake == 0ns) continue;
    for (const rt::CyclicOptions& thread : threads) {
      rows.push_back(rt::executor_timer(thread, name, options.early_wake));
    }
  }
  return rows;
}

/// Of the kernel's trace, which root alone may write to.
constexpr const char* kTraceMarker = "/sys/kernel/tracing/trace_marker";

/// Runs rounds until the number of cycles is reached; without a number, until a signal.
void measure(const Rows& rows, std::uint64_t cycles, const Options& options, Outcome& outcome) {
  const rt::CyclicOptions& cyclic = rows.front()->options();
  const std::uint64_t a_second = std::max<std::int64_t>(1s / cyclic.interval, 1);
  const std::uint64_t a_round =
      cycles == 0 ? a_second : std::max<std::uint64_t>(cycles / kRounds, 1);
  // Without -l the time counts.
  const rt::CyclesOf of = options.loops != 0 ? rt::CyclesOf::each : rt::CyclesOf::first;
  const bool shows_progress = !options.quiet && isatty(STDERR_FILENO) != 0;
  const rt::Observation observation;
  const TimePoint beginning = Clock::steady().now();
  const auto turns = static_cast<std::int64_t>(rows.size() / options.threads * a_round);
  const Nanoseconds all_turns = kGapSearch + turns * cyclic.interval;
  outcome.start = std::time(nullptr);
  if (shows_progress) {
    rt::show_line(fmt::format("measuring; the first figures come in {}", rough(all_turns)));
  }
  for (std::uint64_t done = 0; !stop.load() && (cycles == 0 || done < cycles); done += a_round) {
    rt::find_gaps(cyclic, kGapSearch, outcome.gaps);
    const std::uint64_t now = cycles == 0 ? a_round : std::min(a_round, cycles - done);
    const Nanoseconds end = Clock::steady().now() - beginning + all_turns;
    for (const auto& row : rows) row->expect(beginning, end);
    for (std::size_t first = 0; first < rows.size() && !stop.load(); first += options.threads) {
      rt::run_together(std::span(rows).subspan(first, options.threads), now, of, stop);
      if (options.verbose && options.json != "-") print_values(rows, first, options.threads);
    }
    if (shows_progress) {
      rt::clear_line();
      print_summary(rows, cyclic, stderr);
      std::fprintf(stderr, "\033[%zuA", rows.size());  // over which the next one writes
    }
  }
  if (shows_progress) std::fputs("\033[J", stderr);
  outcome.end = std::time(nullptr);
  outcome.observation = observation.so_far();
}

/// What the system refuses such a thread; empty: nothing.
std::string refused(const ThreadAttributes& attributes) {
  ThreadState state;
  std::thread([&] { state = apply(attributes, Realtime::prefer); }).join();
  if (const std::string outside = cpus_outside(state); !outside.empty()) {
    rt::to_stderr("note: {}\n", outside);
  }
  return state.refused;
}

/// Of cyclictest's -D, where a bare number is seconds, and which knows days.
Nanoseconds time_of(const std::string& text) {
  const std::size_t end = text.find_first_not_of("0123456789");
  if (end == text.npos) return parse_run_time(text + "s");
  if (end == 0 || text.substr(end) != "d") return parse_run_time(text);
  return 24 * parse_run_time(text.substr(0, end) + "h");
}

CLI::Option* cyclictests_time(CLI::Option* option) {
  return option->type_name("TIME")->check(CLI::Validator(
      [](const std::string& text) {
        try {
          time_of(text);
        } catch (const Error& error) {
          return std::string(error.what());
        }
        return std::string();
      },
      ""));
}

void check_words(const Options& options) {
  if (options.early_wake > kMostSpin) {
    throw UsageError("--early-wake: threads wake up at most 1ms early", "write 1ms or less");
  }
  if (options.marks && options.break_us == 0) {
    throw UsageError("--tracemark marks the latency that -b has found", "give -b, too");
  }
  if (!options.histogram_file.empty() && options.bins() == 0) {
    throw UsageError("--histfile is for the histogram of -h or -H", "give one of them, too");
  }
  for (const std::string& note : options.notes) rt::to_stderr("note: {}\n", note);
}

void write_histogram(const Rows& rows, const rt::CyclicOptions& cyclic, const Options& options) {
  write_output(options.histogram_file,
               fmt::format("# {} latency\n{}", kTaktsText,
                           histogram_text(rows, cyclic, options.histogram_with_sum != 0)));
}

void latency(const Options& options) {
  check_words(options);
  rt::CyclicOptions cyclic = cyclic_options(options);
  if (options.marks) cyclic.trace_marker = open(kTraceMarker, O_WRONLY | O_CLOEXEC);
  const std::string no_marker =
      options.marks && cyclic.trace_marker < 0
          ? fmt::format("the trace cannot be marked ({}: {})", kTraceMarker, errno_message(errno))
          : "";
  if (!options.report.empty()) check_report(options.report);
  const std::vector<rt::CyclicOptions> threads = threads_of(options, cyclic);
  for (const rt::CyclicOptions& thread : threads) thread.thread.check();
  const Rows rows = rows_of(options, threads);
  std::uint64_t cycles = options.loops;
  if (!options.duration.empty()) {
    cycles = std::max<std::int64_t>(time_of(options.duration) / cyclic.interval, 1);
  }
  begin_work();
  const EndSignals signals(EndSignals::Command::runs, [] { stop.store(true); });
  Outcome outcome{.threads = options.threads, .load = options.load};
  // Before the measurement, which may take hours.
  const auto note = [&](const std::string& refused) {
    if (refused.empty()) return;
    if (options.require) throw Error(refused, "see takt doctor, or leave out --require");
    outcome.notes.push_back(refused);
    rt::to_stderr("note: {}; measuring without\n", refused);
  };
  note(no_marker);
  note(refused(threads.front().thread));
  const rt::Load load(options.load);  // start before mlockall: its processes must not inherit it
  note(lock_memory(cyclic.realtime));
  const CpuDmaLatency dma_latency(options.dma_latency_us,
                                  options.leaves_dma_latency ? Realtime::off : cyclic.realtime);
  note(dma_latency.refused());
  const bool has_text = options.json != "-", with_sum = options.histogram_with_sum != 0;
  if (has_text && !options.leaves_dma_latency && dma_latency.refused().empty()) {
    rt::print("# /dev/cpu_dma_latency set to {}us\n", options.dma_latency_us);
  }
  measure(rows, cycles, options, outcome);
  const int came = signals.take();
  if (cycles != 0 && came != 0) outcome.return_code = 128 + came;
  if (has_text) {
    const bool has_histogram = options.bins() != 0 && options.histogram_file.empty();
    if (!options.quiet || !has_histogram) print_summary(rows, cyclic, stdout);  // as cyclictest
    if (has_histogram) rt::print("{}", histogram_text(rows, cyclic, with_sum));
    print_details(rows, cyclic, outcome);
    // What the JSON says of this command's end must be known before it is written.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) outcome.return_code = 1;
  }
  if (!options.histogram_file.empty()) write_histogram(rows, cyclic, options);
  if (!options.json.empty()) write_json(to_json(rows, cyclic, outcome), options.json);
  if (!options.report.empty()) {
    nlohmann::json page = rt::result_document({});
    page["jitter"] = to_json(rows, cyclic, outcome);
    write_report(std::move(page), options.report);
  }
  check_complete(came, /*ends_by_itself=*/cycles != 0);
}

/// cyclictest's -t, -a, -S and -d.
void add_threads(CLI::App& command, Options& options) {
  whole_number(
      command.add_option_function<std::string>(
          "-t,--threads",
          [&options](const std::string& count) {
            options.threads = count.empty() ? available_cpus().size() : std::stoul(count);
          },
          "Measuring threads of each row; without a number, one for each CPU (default: 1)"),
      1, 1024)
      ->expected(0, 1);
  command
      .add_option_function<std::string>(
          "-a,--affinity",
          [&options](const std::string& set) { options.affinity = set.empty() ? "all" : set; },
          "CPUs of the threads, one for each in turn: 0-2,5; without a set, all")
      ->expected(0, 1);
  command.add_flag_function(
      "-S,--smp",
      [&options](std::int64_t) {
        options.threads = available_cpus().size();
        options.affinity = "all";
      },
      "One thread for each CPU, and on it: -t -a");
  whole_number(
      command.add_option("-d,--distance", options.distance_us,
                         "How much longer each thread's interval is than the one before, in µs, "
                         "unless there is a histogram (default: 500)"),
      0, 10'000'000);
}

/// How the bare loop sleeps.
void add_sleeping(CLI::App& command, Options& options) {
  whole_number(command.add_option("-c,--clock", options.clock,
                                  "Clock of the bare loop: 0 CLOCK_MONOTONIC, 1 CLOCK_REALTIME "
                                  "(default: 0)"),
               0, 1);
  command.add_flag("-r,--relative", options.relative,
                   "The bare loop sleeps for the interval instead of until a time");
  command.add_flag("-s,--system", options.uses_nanosleep,
                   "The bare loop uses nanosleep, which is relative, on CLOCK_MONOTONIC");
  command.add_flag("--tracemark", options.marks,
                   "When -b ends the measurement, mark the place in the kernel's trace");
}

/// What scripts give to cyclictest, and what is there instead. They are not shown.
struct Ignored {
  const char* names;
  const char* why;
  int values = 0;  // that follow at most
};
constexpr const char* kHistory = "is history of cyclictest, and does nothing here";
constexpr Ignored kIgnored[] = {
    {"-n,--nanosleep", kHistory},
    {"-u,--unbuffered", kHistory},
    {"-U,--numa", kHistory},
    {"-f,--ftrace", kHistory},
    {"-B,--preemptirqs", kHistory},
    {"-C,--context", kHistory},
    {"-E,--event", kHistory},
    {"-I,--irqsoff", kHistory},
    {"-P,--preemptoff", kHistory},
    {"-w,--wakeup", kHistory},
    {"-W,--wakeuprt", kHistory},
    {"-T,--tracer", kHistory, 1},
    {"-O,--traceopt", kHistory, 1},
    {"-A,--aligned", "does nothing here: all threads of a row begin together", 1},
    {"--secaligned", "does nothing here: all threads of a row begin together", 1},
    {"--smi", "does nothing here: gaps in which no thread ran are always measured"},
    {"-R,--resolution", "does nothing here: takt doctor says whether timers are exact"},
    {"-M,--refresh_on_max", "does nothing here: the figures are renewed after each round"},
    {"-o,--oscope", "does nothing here: -v prints every value", 1},
    {"--mainaffinity", "does nothing here: -a is for the threads that measure, taskset for all", 1},
    {"--spike", "does nothing here: --json has the latencies over time, and -b ends at one", 1},
    {"--spike-nodes", "does nothing here: --json has the latencies over time", 1},
    {"-F,--fifo", "does nothing here: the figures go to stderr while it measures", 1},
};

void add_ignored(CLI::App& command, Options& options) {
  for (const Ignored& one : kIgnored) {
    const auto add = [&options, &one](const std::string&) {
      options.notes.push_back(fmt::format("{} {}", one.names, one.why));
    };
    CLI::Option* const option =
        one.values == 0 ? command.add_flag_function(one.names, [add](std::int64_t) { add(""); })
                        : command.add_option_function<std::string>(one.names, add);
    option->group("");
    if (one.values != 0 && one.why != kHistory) option->expected(0, one.values);
  }
}

void add_system(CLI::App& command, Options& options) {
  command.add_flag("--default-system,--laptop", options.leaves_dma_latency,
                   "Do not use /dev/cpu_dma_latency");
  command.add_flag("--priospread", options.spreads_priority,
                   "Each thread has one priority less than the one before, at least 1");
}

void add_outputs(CLI::App& command, Options& options) {
  add_output(command, "--json", options.json, "Write rt-tests' JSON; - for stdout");
  add_output(command, "--report", options.report, "Also write an HTML page with the histogram");
}

void set_up(CLI::App* command) {
  command->set_help_flag("--help", "Print this help message and exit");
  const auto options = std::make_shared<Options>();
  add_sleeping(*command, *options);
  add_ignored(*command, *options);
  add_system(*command, *options);
  whole_number(command->add_option("-p,--priority", options->priority,
                                   "SCHED_FIFO priority; 0 is SCHED_OTHER (default: 0)"),
               0, 99);
  command->add_option("--policy", options->policy,
                      "Instead: fifo, rr, other, batch or idle, or Linux's names: SCHED_FIFO");
  whole_number(
      command->add_option("-i,--interval", options->interval_us, "Period in µs (default: 1000)"),
      20, 10'000'000);
  auto* loops = command->add_option("-l,--loops", options->loops,
                                    "Cycles of each row (default: until Ctrl-C)");
  cyclictests_time(command->add_option("-D,--duration", options->duration,
                                       "Duration of each row, instead of -l: 10s, 1d; a bare "
                                       "number is seconds, as in cyclictest"))
      ->excludes(loops);
  add_threads(*command, *options);
  auto* histogram =
      whole_number(command->add_option("-h,--histogram", options->histogram,
                                       "Print a histogram of this many µs after the run"),
                   1, 1'000'000);
  whole_number(command->add_option("-H,--histofall", options->histogram_with_sum,
                                   "The same with a column for all threads"),
               1, 1'000'000)
      ->excludes(histogram);
  add_output(*command, "--histfile", options->histogram_file,
             "Write the histogram of -h or -H there instead");
  command->add_flag("-v,--verbose", options->verbose, "Print every value: thread:cycle:value");
  command->add_flag_function(
      "-m,--mlockall", [](std::int64_t) {}, "Accepted as in cyclictest; memory is always locked");
  command->add_flag("-q,--quiet", options->quiet, "Print a summary only on exit");
  command->add_flag("-N,--nsecs", options->nanoseconds, "Print in ns instead of µs");
  whole_number(command->add_option("-b,--breaktrace", options->break_us,
                                   "Stop when a latency exceeds this value, in µs, or ns with -N"),
               1, 1'000'000'000);
  command->add_option(
      "--executor", options->executors,
      "all, none, or a list: events,single_threaded (default: events, and none with -h or -H; "
      "see: takt list executors)");
  add_time_option(*command, "--early-wake", options->early_wake,
                  "Add a row for each executor that wakes up this much early: 50us, 1ms at most");
  one_of(command->add_option("--load", options->load, "Background load (default: none)"),
         rt::load_names());
  whole_number(command->add_option("-e,--latency,--cpu-dma-latency", options->dma_latency_us,
                                   "Value of /dev/cpu_dma_latency during the run, in µs "
                                   "(default: 0)"),
               0, 2'000'000'000);
  command->add_flag("--require", options->require,
                    "Fail if the system refuses real-time privileges");
  add_outputs(*command, *options);
  command->footer(
      "Examples:\n  takt latency -p 80 -i 1000 -D 10s -a 1 --executor all --early-wake 50us\n"
      "  takt latency -l100000 -m -Sp90 -i200 -h400 -q\n");
  command->callback([options] { latency(*options); });
}
const Command registered(
    "latency", "Measures wake-up latency as cyclictest does, of executors and of clock_nanosleep",
    set_up);

}  // namespace
}  // namespace takt::tools::latency_command
