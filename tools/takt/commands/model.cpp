// takt model: from traces to a model of execution times and arrivals.
// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "model/extraction.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/result_json.hpp"

namespace takt::tools::model_command {
namespace {

struct Options {
  std::vector<std::string> traces;
  std::string model, json;
  double margin = MeasuredModel{}.margin;
};

/// Traces of several systems would make the model of none.
void check_files(const std::vector<Trace>& traces, const std::vector<std::string>& paths) {
  for (std::size_t i = 1; i < traces.size(); ++i) {
    const std::string first = traces[0].about.at("file"), other = traces[i].about.at("file");
    if (first == other) continue;
    throw Error(fmt::format("this trace is of '{}', but {} is of '{}'", other, paths[0], first),
                "give traces of one system", paths[i]);
  }
}

/// What a mode drops or demotes looks as if nobody had sent it, or as late as it never is.
void check_runs(const std::vector<Trace>& traces, const std::vector<std::string>& paths) {
  for (std::size_t i = 0; i < traces.size(); ++i) {
    if (traces[i].about.at("machine") == kSimulatedMachine) {
      throw Error("this trace is of a simulation, which measures nothing",
                  "trace a run: `takt run FILE --trace OUT`", paths[i]);
    }
    for (const auto& mode : traces[i].about.at("modes")) {
      if (mode == kNormalMode) continue;
      throw Error(
          fmt::format("mode '{}' was in force for a part of this run: what it changes is no "
                      "measure of other modes",
                      mode.get<std::string>()),
          "trace a run in mode 'normal'", paths[i]);
    }
  }
}

/// Executions on one executor are no measure of latencies on another one.
void check_executors(const std::vector<Trace>& traces, const std::vector<std::string>& paths) {
  std::map<std::string, std::pair<std::string, std::size_t>> known;  // by callback: where, of which
  for (std::size_t i = 0; i < traces.size(); ++i) {
    for (const auto& [name, of] : traces[i].about.at("executors").items()) {
      const std::string where =
          fmt::format("'{}', {} with {}", name, of.at("type").get<std::string>(),
                      of.at("scheduler").get<std::string>());
      for (const auto& callback : of.at("callbacks")) {
        if (callback == kRemovedCallbacks) continue;
        const auto& [first, trace] = known.try_emplace(callback, where, i).first->second;
        if (first == where) continue;
        throw Error(fmt::format("'{}' ran on executor {} here, and on {} in '{}'",
                                callback.get<std::string>(), where, first, paths[trace]),
                    "make a model of each", paths[i]);
      }
    }
  }
}

/// Of what the system consisted, and how it was set, as each run itself has found.
void check_systems(const std::vector<Trace>& traces, const std::vector<std::string>& paths) {
  std::map<std::int64_t, std::size_t> begun;
  for (std::size_t i = 0; i < traces.size(); ++i) {
    const auto& about = traces[i].about;
    const std::string machine = rt::lasting_part(about.at("machine")),
                      first = rt::lasting_part(traces.front().about.at("machine"));
    if (machine != first) {
      throw Error(fmt::format("this trace is of '{}', but {} is of '{}'", machine, paths[0], first),
                  "give traces of one machine", paths[i]);
    }
    const auto [other, is_new] = begun.emplace(about.at("begin_ns"), i);
    if (!is_new) {
      throw Error(fmt::format("this trace is of the same run as '{}'", paths[other->second]),
                  "give each run once", paths[i]);
    }
    for (const char* const key : {"components", "settings"}) {
      const auto of = [key](const Trace& trace) {
        return trace.about.value(key, nlohmann::json::object());
      };
      if (of(traces[i]) == of(traces.front())) continue;
      throw Error(fmt::format("this trace is of other {} than '{}'", key, paths.front()),
                  "trace both with the same build and file", paths[i]);
    }
  }
}

void run(const Options& options) {
  std::vector<Trace> traces;
  for (const std::string& path : options.traces) traces.push_back(read_trace(path));
  check_files(traces, options.traces);
  check_runs(traces, options.traces);
  check_systems(traces, options.traces);
  check_executors(traces, options.traces);
  MeasuredModel model = extract_model(traces);
  model.margin = options.margin;
  if (!options.model.empty()) write_measured_model(model, options.model);
  if (!options.json.empty()) write_json(model_json(model), options.json);
  if (options.json == "-") return;
  print_model(model);
  if (!options.model.empty()) rt::to_stderr("written: {}\n", options.model);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command
      ->add_option("TRACE", options->traces,
                   "Files of `takt run --trace`, all of the same system: the model has the longest "
                   "and closest of all")
      ->required();
  add_output(*command, "-o,--output", options->model,
             "Writes the model: a file for `takt analyze --model`");
  number(command->add_option("--margin", options->margin,
                             "What an analysis adds to the longest execution times, 0.2 being a "
                             "fifth (default: 0.2)"),
         0, 10);
  add_output(*command, "--json", options->json, "Also write the model as JSON; - for stdout");
  command->footer(
      "Example, after takt run robot.yaml --duration 60s --trace robot.json:\n"
      "  takt model robot.json -o robot.model.yaml\n"
      "  takt analyze robot.yaml --model robot.model.yaml\n");
  command->callback([options] { run(*options); });
}
const Command registered("model", "Makes a model of execution times and arrivals from traces",
                         set_up);

}  // namespace
}  // namespace takt::tools::model_command
