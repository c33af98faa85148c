// takt rta: analyses of textbooks and papers on bare task sets.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/containers/configuration/document.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "outputs.hpp"
#include "rta/json_lines.hpp"
#include "rta/task_set_file.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::rta_command {
namespace {

namespace textbook = analysis::textbook;
using nlohmann::json;
using textbook::Response;
using textbook::Result;
using textbook::TaskSet;

struct Options {
  std::string file = "-", json_path;
  bool lines = false;
};

TaskSet read(const std::string& file, const std::string& name) {
  document::Errors errors(file == "-" ? "stdin" : file);
  if (file != "-") return read_task_set(document::read(file, errors), name, errors);
  return read_task_set(document::parse_json(read_stdin(errors), errors), name, errors);
}

bool has(const Response& response) {
  return response.bound < analysis::kUnbounded;
}

std::string verdict(const Response& response, const textbook::Task& task) {
  if (!response.why_not.empty()) return response.why_not;
  if (!has(response)) return "no bound below the limit";
  if (!task.deadline) return "";
  return response.bound <= *task.deadline ? "met" : "not shown";
}

void print(const TaskSet& set, const Result& result, const textbook::AnalysisTraits& traits) {
  Table tasks({"task", "C", "T", "J", "D", "R", "busy_window", "deadline"});
  for (std::size_t i = 0; i < result.responses.size(); ++i) {
    const textbook::Task& task = set.tasks[i];
    const Response& response = result.responses[i];
    const auto number = [](const auto& value) { return value ? std::to_string(*value) : "-"; };
    tasks.add({task.name, std::to_string(task.execution), std::to_string(task.period),
               std::to_string(task.jitter), number(task.deadline),
               has(response) ? std::to_string(response.bound) : "-", number(response.busy_window),
               verdict(response, task)});
  }
  tasks.print("R: the longest response");
  Table points({"window", result.is_schedulable ? "demand" : "supply"});
  for (const auto& [window, amount] : result.points) {
    points.add({std::to_string(window), std::to_string(amount)});
  }
  points.print(result.is_schedulable ? "demand at each deadline of the busy window"
                                     : "least supply in any window");
  rt::print("\n");
  if (result.is_schedulable) {
    rt::print("{}\n", *result.is_schedulable ? "all deadlines are met"
                                             : "a deadline is missed: demand above its window");
  }
  rt::print("assumes: {}\nsource: {}\n{}: {}\n", traits.assumes, traits.source,
            traits.applies_to_takt ? "applies to Takt" : "does not apply to Takt", traits.takt);
}

json to_json(const TaskSet& set, const Result& result, const std::string& name) {
  const textbook::AnalysisTraits traits = textbook::analyses().traits(name);
  json document{{"method", name},
                {"assumptions", traits.assumes},
                {"source", traits.source},
                {"applies_to_takt", traits.applies_to_takt},
                {"takt", traits.takt}};
  const auto number = [](const std::optional<analysis::Time>& value) {
    return value ? json(*value) : json();
  };
  for (std::size_t i = 0; i < result.responses.size(); ++i) {
    const Response& response = result.responses[i];
    document["R"].push_back(has(response) ? json(response.bound) : json());
    document["tasks"].push_back({{"name", set.tasks[i].name},
                                 {"R", document["R"].back()},
                                 {"busy_window", number(response.busy_window)},
                                 {"D", number(set.tasks[i].deadline)},
                                 {"verdict", verdict(response, set.tasks[i])}});
  }
  for (const auto& [window, amount] : result.points) {
    document["points"].push_back({{"window", window}, {"amount", amount}});
  }
  if (result.is_schedulable) document["is_schedulable"] = *result.is_schedulable;
  return document;
}

// ---- Many sets, a line each ----

/// Whether each task has a bound, within its deadline if it has one.
bool is_schedulable(const TaskSet& set, const Result& result) {
  if (result.is_schedulable) return *result.is_schedulable;
  for (std::size_t i = 0; i < result.responses.size(); ++i) {
    const Response& response = result.responses[i];
    const auto& deadline = set.tasks[i].deadline;
    if (!has(response) || (deadline && response.bound > *deadline)) return false;
  }
  return true;
}

void rta_lines(const std::string& name) {
  answer_lines("task sets", [&](document::Value& value, document::Errors& errors, json& result) {
    const TaskSet set = read_task_set(value, name, errors);
    try {
      const Result found = textbook::analyse(name, set);
      result["is_schedulable"] = is_schedulable(set, found);
      for (const Response& response : found.responses) {
        result["R"].push_back(has(response) ? json(response.bound) : json());
        if (!response.why_not.empty()) result.emplace("why_not", response.why_not);
      }
    } catch (const Error& error) {  // the tasks want more than there is
      result["is_schedulable"] = false;
      result["why_not"] = error.what();
    }
  });
}

Result result_of_file(const std::string& name, const TaskSet& set, const std::string& file) {
  try {
    return textbook::analyse(name, set);
  } catch (const Error& error) {  // the tasks want more than there is
    throw Error(error.what(), "", file == "-" ? "stdin" : file);
  }
}

void rta(const std::string& name, const Options& options) {
  if (options.lines) return rta_lines(name);
  const TaskSet set = read(options.file, name);
  const Result result = result_of_file(name, set, options.file);
  if (options.json_path != "-") print(set, result, textbook::analyses().traits(name));
  if (!options.json_path.empty()) write_json(to_json(set, result, name), options.json_path);
}

std::string help(const std::string& name) {
  const textbook::AnalysisTraits traits = textbook::analyses().traits(name);
  const std::string keys = traits.keys.empty() ? "" : fmt::format("Of a task: {}\n", traits.keys);
  const std::string tasks = traits.keys.empty() ? "" : "tasks ";
  const std::string settings = traits.settings.empty() ? "" : traits.settings + " ";
  return fmt::format(
      "{}Of the set: {}{}[limit]\nAssumes: {}\nSource: {}\n{}: {}\n\nExample:\n"
      "  takt rta {} <<END\n{}\nEND\n",
      keys, tasks, settings, traits.assumes, traits.source,
      traits.applies_to_takt ? "Applies to Takt" : "Does not apply to Takt", traits.takt, name,
      traits.example);
}

void set_up(CLI::App* command) {
  for (const std::string& name : textbook::analyses().names()) {
    CLI::App* const method = command->add_subcommand(name, textbook::analyses().description(name));
    const auto options = std::make_shared<Options>();
    method->add_option("FILE", options->file, "A task set in JSON or YAML (-: JSON from stdin)");
    add_output(*method, "--json", options->json_path,
               "Also write the result as JSON; - for stdout");
    method
        ->add_flag("--lines", options->lines,
                   "Each line of stdin is a set as JSON, also with an id; a line of JSON for each")
        ->excludes("FILE")
        ->excludes("--json");
    method->footer(help(name));
    method->callback([name, options] { rta(name, *options); });
  }
  command->footer(
      "Times are whole numbers of any unit. takt rta METHOD --help: what it reads, and an "
      "example.\n\nExample:\n  takt rta np_fp tasks.json\n");
  // Of a word that is no method: which are near to it.
  command->allow_extras();
  command->callback([command] {
    if (!command->get_subcommands().empty()) return;
    const std::vector<std::string> words = command->remaining();
    if (!words.empty()) textbook::analyses().check(words.front());
    rt::print("{}", command->help());
  });
}
const Command registered("rta", "Textbook analyses of response times on bare task sets", set_up);

}  // namespace
}  // namespace takt::tools::rta_command
