// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/base/output_file.hpp"
#include "takt/measuring/json_text.hpp"

#include "run/trace.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

double in_us(Nanoseconds time) {
  return static_cast<double>(time.count()) / 1e3;
}

/// A file of write_trace in the making: processes have numbers there.
class TraceWriter {
 public:
  explicit TraceWriter(const Trace& trace) : trace_(trace) {
    for (const TracedThread& thread : trace_.threads) add(thread);
    for (std::size_t i = 0; i < trace_.executions.size(); ++i) add(trace_.executions[i], i);
    add_chains();
    add_backlogs();
    add_modes();
    add_switches();
  }

  json document() {
    std::uint64_t overwritten = 0;
    for (const TracedThread& thread : trace_.threads) overwritten += thread.overwritten;
    json other = trace_.about;
    other["overwritten_executions"] = overwritten;
    return {{"traceEvents", std::move(events_)},
            {"displayTimeUnit", "ns"},
            {"otherData", std::move(other)}};
  }

 private:
  int process_of(const TracedThread& thread) const { return processes_.at(thread.process); }

  void add(const TracedThread& thread) {
    const int number = static_cast<int>(processes_.size()) + 1;
    processes_.try_emplace(thread.process, number);
    events_.push_back({{"ph", "M"},
                       {"pid", process_of(thread)},
                       {"name", "process_name"},
                       {"args", {{"name", thread.process}}}});
    events_.push_back({{"ph", "M"},
                       {"pid", process_of(thread)},
                       {"tid", thread.tid},
                       {"name", "thread_name"},
                       {"args",
                        {{"name", thread.name},
                         {"overwritten", thread.overwritten},
                         {"is_prompt", thread.is_prompt}}}});
  }

  json event(const char* phase, const TracedExecution& execution, const std::string& name,
             Nanoseconds time) const {
    const TracedThread& thread = trace_.threads[execution.thread];
    return {{"ph", phase},
            {"pid", process_of(thread)},
            {"tid", thread.tid},
            {"name", name},
            {"ts", in_us(time)}};
  }

  /// The execution, the time in the ready queue before it, and a mark for messages lost before it.
  void add(const TracedExecution& execution, std::size_t number) {
    json slice = event("X", execution, execution.callback, execution.start);
    slice["cat"] = execution.kind;
    slice["dur"] = in_us(execution.end - execution.start);
    slice["args"] = {{"number", number},
                     {"latency_us", in_us(execution.start - execution.ready)},
                     {"waiting_us", in_us(execution.picked - execution.ready)},
                     {"take_us", in_us(execution.start - execution.picked)},
                     {"cpu_us", in_us(execution.cpu_time)},
                     {"waited", execution.has_waited},
                     {"lost", execution.lost},
                     {"sequence", execution.sequence},
                     {"chain_instance", execution.chain_instance}};
    if (execution.cause) slice["args"]["caused_by"] = *execution.cause;
    events_.push_back(std::move(slice));
    for (const bool begins : {true, false}) {
      json wait = event(begins ? "b" : "e", execution, "ready: " + execution.callback,
                        begins ? execution.ready : execution.picked);
      wait["cat"] = "ready";
      wait["id"] = number;
      events_.push_back(std::move(wait));
    }
    if (execution.lost == 0) return;
    json mark = event("i", execution, fmt::format("{} lost {}", execution.callback, execution.lost),
                      execution.start);
    mark["s"] = "t";
    events_.push_back(std::move(mark));
  }

  /// Arrows from each execution of a chain instance to the next.
  void add_chains() {
    std::map<std::pair<int, std::uint64_t>, std::vector<const TracedExecution*>> chains;
    for (const TracedExecution& execution : trace_.executions) {
      chains[{process_of(trace_.threads[execution.thread]), execution.chain_instance}].push_back(
          &execution);
    }
    std::uint64_t number = 0;
    for (const auto& [instance, steps] : chains) {
      ++number;
      for (std::size_t i = 0; steps.size() > 1 && i < steps.size(); ++i) {
        json arrow = event(i == 0                  ? "s"
                           : i + 1 == steps.size() ? "f"
                                                   : "t",
                           *steps[i], "chain", steps[i]->start);
        arrow["cat"] = "chain";
        arrow["id"] = number;
        arrow["bp"] = "e";
        events_.push_back(std::move(arrow));
      }
    }
  }

  /// How many wait for a callback, where that was more than one: those that are ready, and that
  /// no thread has picked.
  void add_backlogs() {
    struct Change {
      Nanoseconds time;
      int by;
    };
    std::map<std::pair<int, std::string>, std::vector<Change>> changes;
    for (const TracedExecution& execution : trace_.executions) {
      auto& own = changes[{process_of(trace_.threads[execution.thread]), execution.callback}];
      own.push_back({execution.ready, 1});
      own.push_back({execution.picked, -1});
    }
    for (auto& [callback, own] : changes) {
      std::sort(own.begin(), own.end(), [](const Change& a, const Change& b) {
        return std::pair(a.time, a.by) < std::pair(b.time, b.by);
      });
      int waiting = 0, most = 0;
      for (const Change& change : own) most = std::max(most, waiting += change.by);
      if (most < 2) continue;
      for (const Change& change : own) {
        events_.push_back({{"ph", "C"},
                           {"pid", callback.first},
                           {"name", "waiting: " + callback.second},
                           {"ts", in_us(change.time)},
                           {"args", {{"waiting", waiting += change.by}}}});
      }
    }
  }

  /// A mark in the process, when the executors had the changes.
  void add_modes() {
    for (const TracedMode& mode : trace_.modes) {
      const auto process = processes_.find(mode.process);
      if (process == processes_.end()) continue;
      events_.push_back({{"ph", "i"},
                         {"pid", process->second},
                         {"name", fmt::format("mode '{}': {}", mode.mode, mode.cause)},
                         {"cat", "mode"},
                         {"ts", in_us(mode.end)},
                         {"s", "p"},
                         {"args", {{"mode", mode.mode}, {"begin_us", in_us(mode.begin)}}}});
    }
  }

  std::string name_of(std::uint32_t thread) const {
    const auto name = trace_.names.find(thread);
    return name != trace_.names.end() ? name->second : fmt::format("thread {}", thread);
  }

  void add_row(int process, int number, const std::string& name) {
    events_.push_back({{"ph", "M"},
                       {"pid", process},
                       {"tid", number},
                       {"name", "thread_name"},
                       {"args", {{"name", name}}}});
  }

  /// A row for each CPU, what is missing, and marks on rows of the trace's threads. What was before
  /// the first execution is left out.
  void add_switches() {
    if (trace_.switches.empty() && trace_.missing.empty()) return;
    const int process = static_cast<int>(processes_.size()) + 1;
    events_.push_back(
        {{"ph", "M"}, {"pid", process}, {"name", "process_name"}, {"args", {{"name", "Linux"}}}});
    std::map<int, const TracedSwitch*> running;  // by CPU: the last switch
    std::set<int> cpus;
    for (const TracedSwitch& change : trace_.switches) {
      if (cpus.insert(change.cpu).second)
        add_row(process, change.cpu, fmt::format("CPU {}", change.cpu));
      if (change.is_wakeup) {
        add_wakeup(change);
        continue;
      }
      const TracedSwitch* const before = std::exchange(running[change.cpu], &change);
      if (before != nullptr) add_run(process, *before, change.time, change.was_preempted);
    }
    if (trace_.missing.empty()) return;
    const int row = cpus.empty() ? 0 : *cpus.rbegin() + 1;
    add_row(process, row, trace_.missing);
    events_.push_back({{"ph", "i"},
                       {"pid", process},
                       {"tid", row},
                       {"name", trace_.missing},
                       {"ts", 0},
                       {"s", "t"}});
  }

  /// A thread has run from that switch until then.
  void add_run(int process, const TracedSwitch& from, Nanoseconds until, bool was_preempted) {
    const Nanoseconds begin = std::max(from.time, Nanoseconds::zero());
    if (from.next_thread == 0 || until <= begin) return;
    events_.push_back({{"ph", "X"},
                       {"pid", process},
                       {"tid", from.cpu},
                       {"name", name_of(from.next_thread)},
                       {"cat", "sched"},
                       {"ts", in_us(begin)},
                       {"dur", in_us(until - begin)},
                       {"args", {{"tid", from.next_thread}, {"preempted", was_preempted}}}});
  }

  void add_wakeup(const TracedSwitch& wakeup) {
    const auto woken = std::find_if(
        trace_.threads.begin(), trace_.threads.end(),
        [&](const auto& thread) { return thread.tid == static_cast<int>(wakeup.next_thread); });
    if (woken == trace_.threads.end() || wakeup.time < Nanoseconds::zero()) return;
    events_.push_back(
        {{"ph", "i"},
         {"pid", process_of(*woken)},
         {"tid", woken->tid},
         {"name",
          fmt::format("woken by {}", wakeup.thread == 0 ? "the kernel" : name_of(wakeup.thread))},
         {"cat", "sched"},
         {"ts", in_us(wakeup.time)},
         {"s", "t"},
         {"args", {{"cpu", wakeup.cpu}, {"by", wakeup.thread}}}});
  }

  const Trace& trace_;
  std::map<std::string, int> processes_;  // name → number
  json events_ = json::array();
};

}  // namespace

json trace_json(const Trace& trace) {
  return TraceWriter(trace).document();
}

void write_trace(const Trace& trace, const std::string& path) {
  write_output(path, std::string(kTaktsJson) + rt::json_text(trace_json(trace)) + "\n");
}

}  // namespace takt::tools
