// takt run: starts the system that a file describes, and tells what it did.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>
#include <unistd.h>

#include <csignal>
#include <ctime>

#include "commands.hpp"
#include "result_json.hpp"
#include "table.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/duration.hpp"

namespace takt::tools {
namespace {

struct Options {
  std::string file, executor, scheduler, composition = "file", transport = "auto", duration, json;
  bool histograms = false;
};

void print_callbacks(const ProcessResult& result) {
  Table table({"executor", "node", "callback", "kind", "received", "lost", "dropped", "late",
               "too_late", "misses", "p50", "p90", "p99", "p99.9", "max", "exec_p50", "exec_max"});
  for (const auto& callback : result.callbacks) {
    const CallbackStatistics& row = callback.statistics;
    const auto percentile = [&](double fraction) {
      return microseconds(row.latency.percentile(fraction));
    };
    table.add({callback.executor, row.node, row.callback, std::string(to_string(row.kind)),
               std::to_string(row.received),
               row.kind == EntityKind::timer ? "-" : std::to_string(callback.lost()),
               std::to_string(row.dropped + row.overruns), std::to_string(row.late),
               std::to_string(row.too_late), std::to_string(row.deadline_misses), percentile(0.5),
               percentile(0.9), percentile(0.99), percentile(0.999), microseconds(row.latency.max()),
               microseconds(row.execution.percentile(0.5)), microseconds(row.execution.max())});
  }
  table.print("callbacks (latency and execution in µs; a timer's latency is due → start)");
}

void print_threads(const ProcessResult& result) {
  Table table({"executor", "thread", "policy", "priority", "nice", "cpus", "cpu_%", "wakeups"});
  for (const auto& thread : result.threads) {
    const ThreadState& state = thread.statistics.in_force;
    table.add({thread.executor, state.name,
               std::string(to_string(state.policy)) + (state.refused.empty() ? "" : " (refused)"),
               std::to_string(state.priority), std::to_string(state.nice),
               fmt::format("{}", fmt::join(state.affinity, ",")),
               fmt::format("{:.2f}", thread.statistics.cpu_percent()),
               std::to_string(thread.statistics.counters.voluntary_switches)});
  }
  table.print("threads (attributes in force)");
}

void print_process(const ProcessResult& result) {
  Table table({"process", "seconds", "cpu_%", "pss_MB", "allocations"});
  table.add({result.name, fmt::format("{:.2f}", result.duration_s),
             fmt::format("{:.2f}", result.cpu_percent),
             fmt::format("{:.1f}", static_cast<double>(result.pss_kb) / 1024),
             result.allocations_counted ? std::to_string(result.allocations_while_spinning) : "-"});
  table.print("process (allocations: on executor threads, while spinning)");
}

/// Waits for a signal or the end of the duration, with progress on a terminal. The name of the
/// signal that ended it, or nothing.
int wait_for_end(const sigset_t& signals, Nanoseconds duration) {
  const TimePoint start = Clock::steady().now();
  const bool shows_progress = isatty(STDERR_FILENO) != 0 && duration > std::chrono::seconds(2);
  const TimePoint end = duration == Nanoseconds::zero() ? kNever : start + duration;
  int signal = 0;
  for (TimePoint now = start; signal <= 0 && now < end; now = Clock::steady().now()) {
    if (shows_progress) {
      fmt::print(stderr, "\r{:.0f} of {:.0f} s ", std::chrono::duration<double>(now - start).count(),
                 std::chrono::duration<double>(duration).count());
    }
    Nanoseconds step = end == kNever ? std::chrono::hours(24) : end - now;
    if (shows_progress) step = std::min<Nanoseconds>(step, std::chrono::seconds(1));
    const timespec time{step / std::chrono::seconds(1), (step % std::chrono::seconds(1)).count()};
    signal = sigtimedwait(&signals, nullptr, &time);
  }
  if (shows_progress) fmt::print(stderr, "\r                    \r");
  return std::max(signal, 0);
}

void run(const Options& options) {
  if (options.composition == "per-node") {
    throw Error("--composition per-node needs messages between processes, which are not built yet",
                "use --composition file or single");
  }
  if (options.transport == "dds" || options.transport == "shm") {
    throw Error("--transport " + options.transport + " is not built yet", "use auto or intra");
  }
  const Nanoseconds duration =
      options.duration.empty() ? Nanoseconds::zero() : parse_duration(options.duration);

  // Blocked before any thread exists, so that the main thread alone takes them.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  Container container(read_system(options.file),
                      {.executor = options.executor, .scheduler = options.scheduler});
  container.start([] { kill(getpid(), SIGUSR1); });
  wait_for_end(signals, duration);
  container.stop();

  const ProcessResult result = container.result();
  RunDescription description{.file = options.file,
                             .composition = options.composition,
                             .transport = options.transport};
  if (!options.executor.empty()) description.executor = options.executor;
  if (!options.scheduler.empty()) description.scheduler = options.scheduler;
  for (const std::string& note : result.notes) fmt::print(stderr, "note: {}\n", note);
  if (options.json != "-") {
    print_callbacks(result);
    print_threads(result);
    print_process(result);
  }
  if (!options.json.empty()) {
    write_json(result_document({run_json(description, result, options.histograms)}), options.json);
  }
}

}  // namespace

void add_run(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "run", "Starts the system that the file describes; Ctrl-C ends it cleanly");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "A configuration file, or an iRobot JSON workload")
      ->required();
  command
      ->add_option("--executor", options->executor,
                   "Every component under one executor of this type (see: takt list executors)")
      ->envname("TAKT_EXECUTOR");
  command
      ->add_option("--scheduler", options->scheduler,
                   "The scheduler of every executor (see: takt list schedulers)")
      ->envname("TAKT_SCHEDULER");
  command->add_option("--composition", options->composition, "file, single or per-node")
      ->check(CLI::IsMember({"file", "single", "per-node"}));
  command->add_option("--transport", options->transport, "auto, intra, dds or shm")
      ->check(CLI::IsMember({"auto", "intra", "dds", "shm"}));
  command->add_option("--duration", options->duration, "For how long: 10s, 500ms; else until Ctrl-C");
  command->add_option("--json", options->json, "Write the results as JSON too; - for stdout");
  command->add_flag("--histograms", options->histograms, "Histograms in the JSON");
  command->footer("Example:\n  takt run robot.yaml --executor events --duration 10s\n");
  command->callback([options] {
    if (!options->executor.empty()) executors().check(options->executor);
    if (!options->scheduler.empty()) schedulers().check(options->scheduler);
    run(*options);
  });
}

}  // namespace takt::tools
