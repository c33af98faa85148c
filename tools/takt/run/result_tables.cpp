// SPDX-License-Identifier: Apache-2.0
#include "run/result_tables.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/measuring/output.hpp"

#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// "-" where nothing was measured.
std::string us_cell(const json& value) {
  if (value.is_null()) return "-";
  return microseconds(from_us(value));
}

/// Of a histogram with a full bucket, percentiles are marked.
std::string percentile_cell(const json& times, const char* which) {
  return us_cell(times.at(which)) + (times.contains("saturated") ? "~" : "");
}

template <class T>
std::string number_cell(const json& value) {
  return fmt::format("{}", value.get<T>());
}

/// A table whose first column is the process, if there are several.
class ProcessTable {
 public:
  ProcessTable(const json& run, std::vector<std::string> header)
      : several_(run.at("processes").size() > 1), table_(with("process", std::move(header))) {}
  void add(const json& process, std::vector<std::string> row) {
    table_.add(with(process.get<std::string>(), std::move(row)));
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

void print_callbacks(const json& run) {
  ProcessTable table(run, {"executor", "node", "callback", "kind", "received", "lost", "dropped",
                           "overruns", "late", "too_late", "misses", "p50", "p90", "p99", "p99.9",
                           "max", "exec_p50", "exec_max"});
  for (const json& row : run.at("callbacks")) {
    const auto word = [&](const char* key) { return row.at(key).get<std::string>(); };
    const auto number = [&](const char* key) { return row.at(key).get<std::uint64_t>(); };
    const auto number_or_dash = [](const json& count) {
      return count.is_null() ? "-" : number_cell<std::uint64_t>(count);
    };
    const json& latency = row.at("latency_us");
    const json& execution = row.at("execution_us");
    table.add(row.at("process"),
              {word("executor"), word("node"), word("callback"), word("kind"),
               std::to_string(number("received")),
               word("kind") == "timer" ? "-" : std::to_string(number("lost")),
               word("kind") == "timer" ? "-" : std::to_string(number("dropped")),
               std::to_string(number("overruns")), number_or_dash(row.at("late")),
               number_or_dash(row.at("too_late")), std::to_string(number("deadline_misses")),
               percentile_cell(latency, "p50"), percentile_cell(latency, "p90"),
               percentile_cell(latency, "p99"), percentile_cell(latency, "p999"),
               us_cell(latency.at("max")), percentile_cell(execution, "p50"),
               us_cell(execution.at("max"))});
  }
  table.print("callbacks (latency and execution in µs; a timer's latency is due → start)");
}

/// As `SCHED_FIFO`, `SCHED_DEADLINE 2ms/10ms`, `SCHED_OTHER (refused)`.
std::string policy_text(const json& state) {
  std::string text = state.at("policy");
  if (state.contains("runtime_us")) {
    text += fmt::format(" {}ms/{}ms", state.at("runtime_us").get<double>() / 1e3,
                        state.at("period_us").get<double>() / 1e3);
  }
  return text + (state.contains("refused") ? " (refused)" : "");
}

void print_chains(const json& run) {
  ProcessTable table(run, {"chain", "instances", "misses", "aborted", "deadline", "p50", "p90",
                           "p99", "p99.9", "max"});
  for (const json& row : run.at("chains")) {
    const json& latency = row.at("latency_us");
    const bool has_deadline = row.at("deadline_us").get<double>() != 0;
    table.add(
        row.at("process"),
        {row.at("name"), number_cell<std::uint64_t>(row.at("instances")),
         has_deadline && row.at("instances") != 0 ? number_cell<std::uint64_t>(row.at("misses"))
                                                  : "-",
         number_cell<std::uint64_t>(row.at("aborted")),
         has_deadline ? us_cell(row.at("deadline_us")) : "-", percentile_cell(latency, "p50"),
         percentile_cell(latency, "p90"), percentile_cell(latency, "p99"),
         percentile_cell(latency, "p999"), us_cell(latency.at("max"))});
  }
  table.print("chains (release of the first callback → end of the last, in µs)");
}

void print_topics(const json& run) {
  if (run.at("topics").empty()) return;
  ProcessTable table(run, {"topic", "end", "matched", "messages", "uncopied", "lost", "transport"});
  for (const json& row : run.at("topics")) {
    table.add(row.at("process"),
              {row.at("topic"), row.at("is_writer") ? "publisher" : "subscription",
               number_cell<std::uint64_t>(row.at("matched")),
               number_cell<std::uint64_t>(row.at("messages")),
               number_cell<std::uint64_t>(row.at("uncopied")),
               number_cell<std::uint64_t>(row.at("lost")), row.at("transport")});
  }
  table.print("topics between processes (uncopied: sent or received without a copy)");
}

/// Of the thread's executor; the container's own have none that matters.
std::string type_of(const json& run, const json& thread) {
  for (const json& executor : run.at("executors")) {
    if (executor.at("process") == thread.at("process") &&
        executor.at("name") == thread.at("executor")) {
      return executor.at("type");
    }
  }
  return "-";
}

void print_threads(const json& run) {
  ProcessTable table(run, {"executor", "type", "thread", "policy", "priority", "nice", "cpus",
                           "cpu_%", "spin_%", "wakeups"});
  for (const json& row : run.at("threads")) {
    const json& state = row.at("in_force");
    table.add(row.at("process"),
              {row.at("executor"), type_of(run, row), row.at("name"), policy_text(state),
               number_cell<int>(state.at("priority")), number_cell<int>(state.at("nice")),
               fmt::format("{}", fmt::join(state.at("affinity").get<std::vector<int>>(), ",")),
               fmt::format("{:.2f}", row.at("cpu_percent").get<double>()),
               fmt::format("{:.2f}", row.at("spin_percent").get<double>()),
               number_cell<std::uint64_t>(row.at("wakeups"))});
  }
  table.print("threads (attributes in force)");
}

void print_processes(const json& run) {
  Table table({"process", "seconds", "cpu_%", "pss_MB", "allocations", "in_dds"});
  const auto count = [](const json& value) {
    return value.is_null() ? "-" : number_cell<std::uint64_t>(value);
  };
  for (const json& row : run.at("processes")) {
    table.add({row.at("name"), fmt::format("{:.2f}", run.at("duration_s").get<double>()),
               fmt::format("{:.2f}", row.at("cpu_percent").get<double>()),
               fmt::format("{:.1f}", row.at("pss_kb").get<double>() / 1024),
               count(row.at("allocations_while_spinning")), count(row.at("allocations_in_dds"))});
  }
  table.print("processes (allocations: on executor threads, while spinning)");
}

}  // namespace

void print_result(const json& run) {
  print_callbacks(run);
  print_chains(run);
  print_topics(run);
  print_threads(run);
  print_processes(run);
}

}  // namespace takt::tools
