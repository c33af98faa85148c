// SPDX-License-Identifier: Apache-2.0
#include "run/trace_file.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "run/result_json.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// One execution in the format of process_json.
struct Execution {
  int process, thread;
  std::string name, kind;
  std::uint64_t sequence, chain, lost;
  std::int64_t ready_ns, picked_ns, start_ns, end_ns;
};

double us(std::int64_t ns) {
  return static_cast<double>(ns) / 1e3;
}

/// A trace event on a thread.
json event(const char* phase, const Execution& execution, const std::string& name,
           std::int64_t time_ns) {
  return {{"ph", phase},
          {"pid", execution.process},
          {"tid", execution.thread},
          {"name", name},
          {"ts", us(time_ns)}};
}

/// The executions of all threads, sorted by start, in nanoseconds since the first was ready. Adds
/// the names of processes and threads to the events.
std::vector<Execution> read_executions(const json& threads, json& events) {
  std::vector<Execution> executions;
  std::map<std::string, int> processes;  // name → number in the trace
  std::int64_t begin_ns = INT64_MAX;
  for (const json& thread : threads) {
    const std::string name = thread.at("process");
    const int process =
        processes.try_emplace(name, static_cast<int>(processes.size()) + 1).first->second;
    const int tid = thread.at("tid");
    events.push_back(
        {{"ph", "M"}, {"pid", process}, {"name", "process_name"}, {"args", {{"name", name}}}});
    events.push_back({{"ph", "M"},
                      {"pid", process},
                      {"tid", tid},
                      {"name", "thread_name"},
                      {"args", {{"name", thread.at("thread")}}}});
    for (const json& entry : thread.at("events")) {
      executions.push_back({process, tid, entry[0], entry[1], entry[2], entry[3], entry[4],
                            entry[5], entry[6], entry[7], entry[8]});
      begin_ns = std::min(begin_ns, executions.back().ready_ns);
    }
  }
  for (Execution& execution : executions) {
    execution.ready_ns -= begin_ns;
    execution.picked_ns -= begin_ns;
    execution.start_ns -= begin_ns;
    execution.end_ns -= begin_ns;
  }
  std::sort(executions.begin(), executions.end(),
            [](const auto& a, const auto& b) { return a.start_ns < b.start_ns; });
  return executions;
}

/// Adds the execution, the time in the ready queue before it, and a mark for messages lost before
/// it.
void add_execution(json& events, const Execution& execution, std::size_t number) {
  json slice = event("X", execution, execution.name, execution.start_ns);
  slice["cat"] = execution.kind;
  slice["dur"] = us(execution.end_ns - execution.start_ns);
  slice["args"] = {{"latency_us", us(execution.start_ns - execution.ready_ns)},
                   {"waiting_us", us(execution.picked_ns - execution.ready_ns)},
                   {"take_us", us(execution.start_ns - execution.picked_ns)},
                   {"sequence", execution.sequence},
                   {"chain_instance", execution.chain}};
  events.push_back(std::move(slice));
  for (const bool begins : {true, false}) {
    json wait = event(begins ? "b" : "e", execution, "ready: " + execution.name,
                      begins ? execution.ready_ns : execution.picked_ns);
    wait["cat"] = "ready";
    wait["id"] = number;
    events.push_back(std::move(wait));
  }
  if (execution.lost != 0) {
    json mark = event("i", execution, fmt::format("{} lost {}", execution.name, execution.lost),
                      execution.start_ns);
    mark["s"] = "t";
    events.push_back(std::move(mark));
  }
}

/// Adds arrows from each execution of a chain instance to the next.
void add_chains(json& events, const std::vector<Execution>& executions) {
  std::map<std::pair<int, std::uint64_t>, std::vector<const Execution*>> chains;
  for (const Execution& execution : executions) {
    chains[{execution.process, execution.chain}].push_back(&execution);
  }
  std::uint64_t number = 0;
  for (const auto& [instance, steps] : chains) {
    ++number;
    for (std::size_t i = 0; steps.size() > 1 && i < steps.size(); ++i) {
      json arrow = event(i == 0                  ? "s"
                         : i + 1 == steps.size() ? "f"
                                                 : "t",
                         *steps[i], "chain", steps[i]->start_ns);
      arrow["cat"] = "chain";
      arrow["id"] = number;
      arrow["bp"] = "e";
      events.push_back(std::move(arrow));
    }
  }
}

}  // namespace

void write_trace(const json& threads, const std::string& path) {
  json events = json::array();
  const std::vector<Execution> executions = read_executions(threads, events);
  for (std::size_t i = 0; i < executions.size(); ++i) add_execution(events, executions[i], i);
  add_chains(events, executions);
  std::uint64_t overwritten = 0;
  for (const json& thread : threads) overwritten += thread.at("overwritten").get<std::uint64_t>();
  std::ofstream file(path);
  file << json{{"traceEvents", std::move(events)},
               {"displayTimeUnit", "ns"},
               {"otherData", {{"overwritten_executions", overwritten}}}}
              .dump()
       << "\n";
  file.close();
  if (!file) throw not_written("the trace", path);
}

}  // namespace takt::tools
