// SPDX-License-Identifier: Apache-2.0
#include "run/trace.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <new>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/row_json.hpp"
#include "takt/measuring/run_fields.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

// ---- From a result ----

/// The row of callbacks that were removed and have none of their own: it has no node.
bool is_sum(const rt::Run::Callback& callback) {
  return callback.statistics.node.empty();
}

/// Which executors have run which callbacks, by name; those of several processes as in `analyze`.
json executors_of(const rt::Run& run, bool has_several_processes) {
  const auto name_of = [&](const auto& row) {
    return has_several_processes ? row.process + "/" + row.executor : row.executor;
  };
  std::map<std::string, const rt::Run::Traced*> threads;  // one of each that has run something
  for (const rt::Run::Traced& thread : *run.trace) threads[name_of(thread)] = &thread;
  json result = json::object();
  for (const rt::Run::Callback& callback : run.callbacks) {
    const auto thread = threads.find(name_of(callback));
    if (thread == threads.end() || is_sum(callback)) continue;
    json& executor = result[thread->first];
    executor["type"] = thread->second->executor_type;
    executor["scheduler"] = thread->second->scheduler;
    executor["callbacks"].push_back(callback.statistics.node + "/" + callback.statistics.callback);
  }
  return result;
}

json about(const rt::Run& run, bool has_several_processes) {
  json callbacks = json::array(), chains = json::array();
  for (const rt::Run::Callback& callback : run.callbacks) {
    if (is_sum(callback)) continue;
    callbacks.push_back(callback.statistics.node + "/" + callback.statistics.callback);
  }
  for (const rt::Run::Chain& chain : run.chains) chains.push_back(rt::row_json(chain, false));
  std::set<std::string> modes;
  for (const auto& mode : run.mode_switches) modes.insert(mode.mode);
  return {{"file", run.file},
          {"machine", rt::machine_line()},
          {"duration_s", run.duration_s},
          {"executors", executors_of(run, has_several_processes)},
          {"callbacks", std::move(callbacks)},
          {"chains", std::move(chains)},
          {"modes", modes},
          {"active_nodes", run.active_nodes}};
}

/// An execution, and what tells which others belong to it.
struct Found {
  TracedExecution execution;
  std::uint64_t path, cause;  // 0: no other one
};

Found found(const json& event, std::size_t thread) {
  const auto ns = [&](std::size_t place) {
    return Nanoseconds(event.at(place).get<std::int64_t>());
  };
  return {{.thread = thread,
           .callback = event.at(0),
           .kind = event.at(1),
           .sequence = event.at(2),
           .chain_instance = event.at(3),
           .lost = event.at(4),
           .ready = ns(5),
           .picked = ns(6),
           .start = ns(7),
           .end = ns(8),
           .cpu_time = ns(9),
           .has_waited = event.at(12)},
          event.at(10),
          event.at(11)};
}

/// Of the executions in a process with this path and chain instance, the last one that had begun
/// when the message was published.
void set_causes(std::vector<TracedExecution>& executions, const std::vector<Found>& all,
                const std::vector<TracedThread>& threads) {
  std::map<std::tuple<std::string, std::uint64_t, std::uint64_t>, std::vector<std::size_t>> known;
  for (std::size_t i = 0; i < all.size(); ++i) {
    known[{threads[all[i].execution.thread].process, all[i].execution.chain_instance, all[i].path}]
        .push_back(i);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    const TracedExecution& execution = all[i].execution;
    if (all[i].cause == 0) continue;
    const auto candidates =
        known.find({threads[execution.thread].process, execution.chain_instance, all[i].cause});
    if (candidates == known.end()) continue;
    for (const std::size_t candidate : candidates->second) {
      if (all[candidate].execution.start <= execution.ready) executions[i].cause = candidate;
    }
  }
}

// ---- From a file ----

/// Throws json::exception if something that make_trace writes there is missing.
void check_about(const json& about) {
  for (const char* key : {"file", "machine"}) about.at(key).get<std::string>();
  about.at("duration_s").get<double>();
  about.at("clock").get<std::string>();
  about.at("begin_ns").get<std::int64_t>();
  for (const json& executor : about.at("executors")) {
    for (const char* key : {"type", "scheduler"}) executor.at(key).get<std::string>();
    executor.at("callbacks").get<std::vector<std::string>>();
  }
  about.at("callbacks").get<std::vector<std::string>>();
  about.at("modes").get<std::vector<std::string>>();
  about.value("active_nodes", json::array()).get<std::vector<std::string>>();  // of a later Takt
  for (const char* key : {"components", "settings"})                           // of `takt run` only
    about.value(key, json::object()).get<std::map<std::string, std::string>>();
  for (const json& chain : about.at("chains")) {
    chain.at("name").get<std::string>();
    const json& latency = chain.at("latency_us");
    if (latency.at("count").get<std::uint64_t>() == 0) continue;  // then the others are null
    for (const char* key : {"p50", "p99", "p999", "max"}) latency.at(key).get<double>();
  }
}

/// Throws an exception of the library if the document is something else.
Trace trace_of(const json& document) {
  Trace trace{.about = document.at("otherData")};
  std::map<int, std::string> processes;
  std::map<std::pair<int, int>, std::size_t> threads;  // by process and tid
  for (const json& event : document.at("traceEvents")) {
    const std::string phase = event.at("ph");
    if (phase == "M" && event.at("name") == "process_name") {
      processes[event.at("pid")] = event.at("args").at("name");
    } else if (phase == "M" && event.at("args").contains("is_prompt")) {  // else a CPU
      threads[{event.at("pid"), event.at("tid")}] = trace.threads.size();
      const json& args = event.at("args");
      trace.threads.push_back({processes.at(event.at("pid")), args.at("name"), event.at("tid"),
                               args.at("overwritten"), args.at("is_prompt")});
    } else if (phase == "X" && event.at("cat") != "sched") {
      const json& args = event.at("args");
      TracedExecution execution{.thread = threads.at({event.at("pid"), event.at("tid")}),
                                .callback = event.at("name"),
                                .kind = event.at("cat"),
                                .sequence = args.at("sequence"),
                                .chain_instance = args.at("chain_instance"),
                                .lost = args.at("lost"),
                                .start = rt::from_us(event.at("ts")),
                                .cpu_time = rt::from_us(args.at("cpu_us")),
                                .has_waited = args.at("waited")};
      execution.end = execution.start + rt::from_us(event.at("dur"));
      execution.ready = execution.start - rt::from_us(args.at("latency_us"));
      execution.picked = execution.start - rt::from_us(args.at("take_us"));
      if (args.contains("caused_by")) execution.cause = args.at("caused_by");
      trace.executions.push_back(std::move(execution));
    }
  }
  check_about(trace.about);
  for (const TracedExecution& execution : trace.executions) {
    if (execution.cause) trace.executions.at(*execution.cause);
  }
  return trace;
}

}  // namespace

Nanoseconds TraceFrame::on_clock(Nanoseconds monotonic) const {
  const double passed =
      std::chrono::duration<double>(monotonic - begin.time_since_epoch()) /
      std::max(std::chrono::duration<double>(end - begin), std::chrono::duration<double>(1e-9));
  const auto correction = static_cast<double>((end_offset - begin_offset).count());
  return monotonic + begin_offset + Nanoseconds(std::llround(correction * passed));
}

TraceRecorder::TraceRecorder(const std::string& clock) : clock_(clock) {
  frame_.clock = clock;
  frame_.begin = Clock::steady().now();
  frame_.begin_offset = clock_.offset();
}

TraceFrame TraceRecorder::end() {
  frame_.end = Clock::steady().now();
  frame_.end_offset = clock_.offset();
  frame_.scheduling = scheduling_.end();
  return frame_;
}

Trace make_trace(const rt::Run& run, bool has_several_processes,
                 const std::function<bool(const rt::Run::Traced&)>& is_held,
                 const TraceFrame& frame) {
  Trace trace{.about = about(run, has_several_processes)};
  std::vector<Found> all;
  for (const rt::Run::Traced& thread : *run.trace) {
    for (const json& event : thread.events) all.push_back(found(event, trace.threads.size()));
    trace.threads.push_back({thread.process, thread.thread, thread.tid, thread.overwritten,
                             thread.is_realtime && !is_held(thread)});
  }
  std::sort(all.begin(), all.end(),
            [](const Found& a, const Found& b) { return a.execution.start < b.execution.start; });
  Nanoseconds first = frame.end.time_since_epoch();
  for (const Found& one : all) first = std::min(first, one.execution.ready);
  const Nanoseconds begin = frame.on_clock(first);
  trace.about["clock"] = frame.clock;
  trace.about["begin_ns"] = begin.count();
  for (const Found& one : all) {
    TracedExecution& execution = trace.executions.emplace_back(one.execution);
    for (auto time : {&TracedExecution::ready, &TracedExecution::picked, &TracedExecution::start,
                      &TracedExecution::end}) {
      execution.*time = frame.on_clock(execution.*time) - begin;
    }
  }
  set_causes(trace.executions, all, trace.threads);
  for (const ProcessResult::ModeSwitch& mode : run.mode_switches) {
    const auto time = [&](std::int64_t ns) { return frame.on_clock(Nanoseconds(ns)) - begin; };
    if (Nanoseconds(mode.end_ns) < first) continue;
    trace.modes.push_back(
        {mode.process, mode.mode, mode.cause, time(mode.begin_ns), time(mode.end_ns)});
  }
  for (const Scheduling::Event& event : frame.scheduling.events) {
    trace.switches.push_back({frame.on_clock(event.time.time_since_epoch()) - begin, event.cpu,
                              event.thread, event.next_thread, event.was_preempted,
                              event.is_wakeup});
  }
  trace.names = frame.scheduling.names;
  trace.missing = frame.scheduling.missing;
  return trace;
}

// Limit: bytes of a trace that `takt model` reads. At it: the file is refused. Seen: the error.
constexpr std::size_t kMostTraceBytes = std::size_t{1} << 30;

Trace read_trace(const std::string& path) {
  const std::string text = read_text(path, kMostTraceBytes);
  try {
    return trace_of(rt::parse_json(text));
  } catch (const std::bad_alloc&) {
    throw Error("no memory is left to read this trace",
                "raise the limit (ulimit -v), or run for a shorter time", path);
  } catch (const std::exception&) {  // of the JSON, which quotes the file; or no such process
    throw Error("this is not a trace of this version of Takt",
                "give a file that `takt run --trace` wrote", path);
  }
}

}  // namespace takt::tools
