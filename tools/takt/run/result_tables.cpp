// SPDX-License-Identifier: Apache-2.0
#include "run/result_tables.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "table.hpp"

namespace takt::tools {
namespace {

using rt::Run;

/// "-" where nothing was measured. Of a histogram with a full bucket, percentiles are marked.
std::string percentile_cell(const Histogram& times, double fraction) {
  if (times.count() == 0) return "-";
  return microseconds(times.percentile(fraction)) + (times.is_saturated() ? "~" : "");
}
std::string max_cell(const Histogram& times) {
  return times.count() == 0 ? "-" : microseconds(times.max());
}

std::string count_cell(const std::optional<std::uint64_t>& count) {
  return count ? std::to_string(*count) : "-";
}

/// Also a simulation, which has no `processes`.
bool has_several_processes(const Run& run) {
  return run.processes.size() > 1 ||
         std::any_of(run.executors.begin(), run.executors.end(), [&](const Run::Executor& other) {
           return other.process != run.executors.front().process;
         });
}

/// A table whose first column is the process, if there are several.
class ProcessTable {
 public:
  ProcessTable(const Run& run, std::vector<std::string> header)
      : several_(has_several_processes(run)), table_(with("process", std::move(header))) {}
  void add(const std::string& process, std::vector<std::string> row) {
    table_.add(with(process, std::move(row)));
  }
  void print(const std::string& title) const { table_.print(title); }

 private:
  std::vector<std::string> with(const std::string& first, std::vector<std::string> row) const {
    if (several_) row.insert(row.begin(), first);
    return row;
  }
  const bool several_;
  Table table_;
};

void print_callbacks(const Run& run) {
  ProcessTable table(run, {"executor", "node", "callback", "kind", "received", "lost", "dropped",
                           "overruns", "late", "too_late", "misses", "p50", "p90", "p99", "p99.9",
                           "max", "exec_p50", "exec_max"});
  for (const Run::Callback& row : run.callbacks) {
    const CallbackStatistics& of = row.statistics;
    const bool is_timer = of.kind == EntityKind::timer;
    table.add(row.process,
              {row.executor, of.node, of.callback, std::string(to_string(of.kind)),
               count_cell(of.received), is_timer ? "-" : count_cell(of.lost()),
               is_timer ? "-" : count_cell(of.dropped), count_cell(of.overruns),
               count_cell(of.late), count_cell(of.too_late), count_cell(of.deadline_misses),
               percentile_cell(of.latency, 0.5), percentile_cell(of.latency, 0.9),
               percentile_cell(of.latency, 0.99), percentile_cell(of.latency, 0.999),
               max_cell(of.latency), percentile_cell(of.execution, 0.5), max_cell(of.execution)});
  }
  table.print("callbacks (latency and execution in µs; a timer's latency is due → start)");
}

/// As `SCHED_FIFO`, `SCHED_DEADLINE 2ms/10ms`, `SCHED_OTHER (refused)`.
std::string policy_text(const ThreadState& state) {
  std::string text(to_string(state.policy));
  if (state.policy == ThreadPolicy::deadline) {
    text += fmt::format(" {}ms/{}ms", rt::us(state.runtime) / 1e3, rt::us(state.period) / 1e3);
  }
  return text + (state.refused.empty() ? "" : " (refused)");
}

void print_chains(const Run& run) {
  ProcessTable table(run, {"chain", "instances", "misses", "aborted", "deadline", "p50", "p90",
                           "p99", "p99.9", "max"});
  for (const Run::Chain& row : run.chains) {
    const ChainStatistics& of = row.statistics;
    const bool has_deadline = row.deadline != Nanoseconds::zero();
    table.add(row.process, {row.name, count_cell(of.instances),
                            has_deadline && of.instances != 0 ? count_cell(of.misses) : "-",
                            count_cell(of.aborted), has_deadline ? microseconds(row.deadline) : "-",
                            percentile_cell(of.latency, 0.5), percentile_cell(of.latency, 0.9),
                            percentile_cell(of.latency, 0.99), percentile_cell(of.latency, 0.999),
                            max_cell(of.latency)});
  }
  table.print("chains (release of the first callback → end of the last, in µs)");
}

void print_allocations(const Run& run) {
  ProcessTable table(run, {"node", "callback", "received", "allocations", "each"});
  bool are_some = false;
  for (const Run::Callback& row : run.callbacks) {
    const CallbackStatistics& of = row.statistics;
    if (of.allocations.value_or(0) == 0) continue;
    are_some = true;
    const double each = static_cast<double>(*of.allocations) /
                        static_cast<double>(std::max<std::uint64_t>(of.received, 1));
    table.add(row.process, {of.node, of.callback, count_cell(of.received),
                            count_cell(of.allocations), fmt::format("{:.2f}", each)});
  }
  if (are_some) table.print("callbacks that allocate (with what they publish; not inside DDS)");
}

void print_modes(const Run& run) {
  if (run.mode_switches.empty()) return;
  ProcessTable switches(run, {"mode", "after", "cause"});
  for (const ProcessResult::ModeSwitch& row : run.mode_switches) {
    switches.add(row.process, {row.mode, microseconds(row.after), row.cause});
  }
  switches.print("modes (time from the start of the timers, in µs)");
  ProcessTable dropped(run, {"node", "callback", "received", "dropped_by_mode"});
  bool are_some = false;
  for (const Run::Callback& row : run.callbacks) {
    if (row.statistics.dropped_by_mode == 0) continue;
    are_some = true;
    dropped.add(row.process,
                {row.statistics.node, row.statistics.callback, count_cell(row.statistics.received),
                 count_cell(row.statistics.dropped_by_mode)});
  }
  if (are_some) dropped.print("what modes have dropped");
}

void print_topics(const Run& run) {
  if (run.topics.empty()) return;
  ProcessTable table(run, {"topic", "end", "matched", "messages", "uncopied", "lost", "transport"});
  for (const Run::Topic& row : run.topics) {
    table.add(row.process, {row.topic, row.is_writer ? "publisher" : "subscription",
                            count_cell(row.matched), count_cell(row.messages),
                            count_cell(row.uncopied), count_cell(row.lost), row.transport});
  }
  table.print("topics between processes (uncopied: sent or received without a copy)");
}

/// Of the thread's executor; the container's own have none that matters.
std::string type_of(const Run& run, const Run::Thread& thread) {
  for (const Run::Executor& executor : run.executors) {
    if (executor.process == thread.process && executor.name == thread.executor) {
      return executor.type;
    }
  }
  return "-";
}

void print_threads(const Run& run) {
  ProcessTable table(run, {"executor", "type", "thread", "policy", "priority", "nice", "cpus",
                           "cpu_%", "spin_%", "wakeups"});
  for (const Run::Thread& row : run.threads) {
    const ThreadState& state = row.in_force;
    table.add(row.process, {row.executor, type_of(run, row), row.name, policy_text(state),
                            std::to_string(state.priority), std::to_string(state.nice),
                            fmt::format("{}", fmt::join(state.affinity, ",")),
                            fmt::format("{:.2f}", row.cpu_percent),
                            fmt::format("{:.2f}", row.spin_percent), count_cell(row.wakeups)});
  }
  table.print("threads (attributes in force)");
}

void print_processes(const Run& run) {
  if (run.processes.empty()) return;  // of a simulation
  Table table({"process", "seconds", "cpu_%", "pss_MB", "allocations", "in_dds"});
  for (const Run::Process& row : run.processes) {
    table.add({row.name, fmt::format("{:.2f}", run.duration_s),
               fmt::format("{:.2f}", row.cpu_percent),
               fmt::format("{:.1f}", static_cast<double>(row.pss_kb) / 1024),
               count_cell(row.allocations_while_spinning), count_cell(row.allocations_in_dds)});
  }
  table.print("processes (allocations: on executor threads, while spinning)");
}

void print_deviations(const Run& run) {
  if (!run.deviations) return;
  if (run.deviations->empty()) {
    const bool is_coarse = std::any_of(
        run.notes.begin(), run.notes.end(),
        [](const std::string& note) { return note.find("was checked coarsely") != note.npos; });
    rt::print("nothing has deviated from what the bounds rest on{}\n\n",
              is_coarse ? ", as far as it was seen: see the notes" : "");
    return;
  }
  ProcessTable table(run, {"assumption", "times", "what was seen", "bounds of"});
  for (const ProcessResult::Deviation& row : *run.deviations) {
    table.add(row.process, {row.id, count_cell(row.count), row.text,
                            fmt::format("{}", fmt::join(row.chains, ", "))});
  }
  table.print("deviations from what the bounds rest on");
}

}  // namespace

void print_result(const Run& run) {
  print_callbacks(run);
  print_chains(run);
  print_allocations(run);
  print_modes(run);
  print_topics(run);
  print_threads(run);
  print_processes(run);
  print_deviations(run);
}

}  // namespace takt::tools
