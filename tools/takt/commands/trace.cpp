// takt trace: a timeline of a running container.
// SPDX-License-Identifier: Apache-2.0
#include "run/trace.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/containers/get_statistics.hpp"
#include "takt/containers/trace_container.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/run.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "graph/domain_option.hpp"
#include "graph/service_call.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"

namespace takt::tools::trace_command {
namespace {

using Response = TraceContainer::Response;

struct Options {
  DomainOption domain;
  std::string container, clock = "monotonic", file;
};

/// A container that answers.
class Traced {
 public:
  explicit Traced(const Options& options)
      : options_(options),
        whose_(fmt::format("container '{}'", options.container)),
        caller_(options.domain.number()) {
    caller_.check_is_one(service(), whose_);
  }

  Response ask(const TraceContainer::Request& request) {
    Response answer = caller_.call<TraceContainer>(service(), request, whose_);
    if (!answer.success) throw Error(fmt::format("{}: {}", whose_, answer.reason));
    return answer;
  }
  GetStatistics::Response statistics() {
    return caller_.call<GetStatistics>(service_of(options_.container, "/get_statistics"), {},
                                       whose_);
  }

 private:
  std::string service() const { return service_of(options_.container, "/trace"); }

  const Options& options_;
  const std::string whose_;
  Caller caller_;
};

void start(const Options& options) {
  Traced(options).ask({.command = "start", .clock = options.clock});
  rt::print("{} is traced; write it with: takt trace stop {} -o FILE\n", options.container,
            options.container);
}

/// As the result of a run has it.
void add_events(const Response& page, const std::vector<TraceContainer::Callback>& callbacks,
                std::vector<rt::Run::Traced>& threads) {
  for (const TraceContainer::Event& event : page.events) {
    const TraceContainer::Callback& of = callbacks.at(event.callback);
    threads.at(event.thread)
        .events.push_back({of.name, of.kind, event.sequence, event.chain_instance, event.lost,
                           event.ready_ns, event.picked_ns, event.start_ns, event.end_ns,
                           event.cpu_time_ns, event.path, event.cause, event.has_waited});
  }
}

rt::Run run_of(const Options& options, const Response& stopped,
               const GetStatistics::Response& statistics) {
  rt::Run run{.file = "container " + options.container,
              .duration_s = static_cast<double>(stopped.end_ns - stopped.begin_ns) / 1e9};
  for (const GetStatistics::Callback& callback : statistics.callbacks) {
    rt::Run::Callback& row = run.callbacks.emplace_back();
    row.process = options.container;
    row.executor = callback.executor;
    row.statistics.node = callback.node;
    row.statistics.callback = callback.callback;
  }
  for (const TraceContainer::Mode& mode : stopped.modes) {
    run.mode_switches.push_back({.mode = mode.mode,
                                 .cause = mode.cause,
                                 .begin_ns = mode.begin_ns,
                                 .end_ns = mode.end_ns,
                                 .process = options.container});
  }
  run.trace.emplace();
  for (const TraceContainer::Thread& thread : stopped.threads) {
    run.trace->push_back({.process = options.container,
                          .executor = thread.executor,
                          .executor_type = thread.executor_type,
                          .scheduler = thread.scheduler,
                          .thread = thread.name,
                          .tid = thread.tid,
                          .is_realtime = thread.is_realtime && !thread.is_held,
                          .overwritten = thread.overwritten,
                          .events = nlohmann::json::array()});
  }
  return run;
}

void add_switches(const Response& page, std::vector<Scheduling::Event>& events) {
  for (const TraceContainer::Switch& change : page.switches) {
    Scheduling::Event& event = events.emplace_back();
    event.time = TimePoint(Nanoseconds(change.time_ns));
    event.cpu = change.cpu;
    event.thread = change.thread;
    event.next_thread = change.next_thread;
    event.was_preempted = change.was_preempted;
    event.is_wakeup = change.is_wakeup;
  }
}

void stop(const Options& options) {
  if (options.file.empty()) throw UsageError("a trace needs a file", "write: -o FILE");
  Traced traced(options);
  const Response stopped = traced.ask({.command = "stop"});
  rt::Run run = run_of(options, stopped, traced.statistics());
  TraceFrame frame{.clock = stopped.clock,
                   .begin = TimePoint(Nanoseconds(stopped.begin_ns)),
                   .end = TimePoint(Nanoseconds(stopped.end_ns)),
                   .begin_offset = Nanoseconds(stopped.begin_offset_ns),
                   .end_offset = Nanoseconds(stopped.end_offset_ns)};
  frame.scheduling.missing = stopped.missing;
  for (const auto& [thread, name] : stopped.names) frame.scheduling.names.emplace(thread, name);
  std::size_t executions = 0;
  for (std::uint32_t page = 0; page < stopped.pages; ++page) {
    const Response read = traced.ask({.command = "read", .page = page});
    try {
      add_events(read, stopped.callbacks, *run.trace);
    } catch (const std::out_of_range&) {
      throw Error(fmt::format("the answer of container '{}' is not read: it names what it has not",
                              options.container));
    }
    add_switches(read, frame.scheduling.events);
    executions += read.events.size();
  }
  write_trace(make_trace(
                  run, false, [](const rt::Run::Traced&) { return false; }, frame),
              options.file);
  traced.ask({.command = "forget"});
  rt::print("{}: {} executions in {:.3g} s\n", options.file, executions, run.duration_s);
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what) {
    CLI::App* const sub = command->add_subcommand(name, what);
    sub->add_option("CONTAINER", options->container, "The container's name")->required();
    options->domain.add_to(*sub);
    return sub;
  };
  CLI::App* const begin = add(
      "start", "Records from now on: the last 65536 executions of each thread, or fewer of many");
  trace_clock_option(begin, options->clock);
  begin->callback([options] { start(*options); });
  CLI::App* const end =
      add("stop", "Ends that, and writes a timeline for ui.perfetto.dev or chrome://tracing");
  add_output(*end, "-o,--output", options->file, "The file");
  end->callback([options] { stop(*options); });
  command->footer(
      "Example:\n"
      "  takt trace start robot\n"
      "  takt trace stop robot -o robot.json\n");
}
const Command registered("trace", "Records a timeline of a running container", set_up);

}  // namespace
}  // namespace takt::tools::trace_command
