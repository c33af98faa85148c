// takt callback: changes callbacks of running containers.
// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/containers/get_statistics.hpp"
#include "takt/containers/set_callback_parameters.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "graph/domain_option.hpp"
#include "graph/service_call.hpp"

namespace takt::tools::callback_command {
namespace {

struct Options {
  DomainOption domain;
  std::string container, callback;
  std::vector<std::string> changes;
};

std::optional<int> priority_of(std::string_view text) {
  int value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Of a word KEY=VALUE.
void read_change(const std::string& word, CallbackParameters& parameters) {
  const std::map<std::string, std::optional<Nanoseconds>*> times{{"deadline", &parameters.deadline},
                                                                 {"budget", &parameters.budget}};
  const std::size_t middle = word.find('=');
  if (middle == std::string::npos) {
    throw UsageError(fmt::format("'{}' is not a change", word), "write KEY=VALUE: priority=9");
  }
  const std::string key = word.substr(0, middle), value = word.substr(middle + 1);
  const auto time = times.find(key);
  if (key != "priority" && time == times.end()) {
    throw UsageError(fmt::format("'{}' cannot be changed", key),
                     suggest(key, std::vector<std::string>{"priority", "deadline", "budget"}));
  }
  if (time == times.end() ? parameters.priority.has_value() : time->second->has_value()) {
    throw UsageError(fmt::format("'{}' is there twice", key), "write it once");
  }
  if (time != times.end()) {
    *time->second = as_usage([&] { return parse_run_time(value); });
  } else if (!(parameters.priority = priority_of(value))) {
    throw UsageError(fmt::format("'{}' is not a whole number", value), "write priority=9");
  }
}

/// As the file writes them: "priority: 9, deadline: 2ms".
std::string changes_of(const std::vector<std::string>& words) {
  CallbackParameters parameters;
  for (const std::string& word : words) read_change(word, parameters);
  as_usage([&] { parameters.check(); });
  std::vector<std::string> changes;
  if (parameters.priority) changes.push_back(fmt::format("priority: {}", *parameters.priority));
  if (parameters.deadline) {
    changes.push_back("deadline: " + takt::to_string(*parameters.deadline));
  }
  if (parameters.budget) changes.push_back("budget: " + takt::to_string(*parameters.budget));
  return fmt::format("{}", fmt::join(changes, ", "));
}

std::string name_of(const GetStatistics::Callback& callback) {
  return callback.node + "/" + callback.callback;
}

// The slash of the node may be missing.
const GetStatistics::Callback& find(const GetStatistics::Response& answer,
                                    const std::string& wanted) {
  const std::string full = wanted.starts_with('/') ? wanted : "/" + wanted;
  std::vector<std::string> names;
  for (const GetStatistics::Callback& callback : answer.callbacks) {
    if (name_of(callback) == full) return callback;
    names.push_back(name_of(callback));
  }
  throw Error(fmt::format("there is no callback '{}'", full), suggest(full, names));
}

std::string limit_text(std::int64_t ns) {
  return ns == 0 ? "none" : to_string(Nanoseconds(ns));
}

void set(const Options& options) {
  const std::string changes = changes_of(options.changes);
  Caller caller(options.domain.number());
  const std::string whose = fmt::format("container '{}'", options.container);
  const std::string statistics = service_of(options.container, "/get_statistics");
  caller.check_is_one(statistics, whose);
  const auto before = caller.call<GetStatistics>(statistics, {}, whose);
  const GetStatistics::Callback& callback = find(before, options.callback);
  // JSON's strings are YAML's, whatever a name has.
  const std::string request =
      fmt::format("{}: {{callbacks: {{{}: {{{}}}}}}}", rt::json_text(nlohmann::json(callback.node)),
                  rt::json_text(nlohmann::json(callback.callback)), changes);
  const auto answer = caller.call<SetCallbackParameters>(
      service_of(options.container, "/set_callback_parameters"), {request}, whose);
  if (!answer.success) throw Error(answer.reason);
  const auto after = caller.call<GetStatistics>(statistics, {}, whose);
  const GetStatistics::Callback& now = find(after, options.callback);
  rt::print("{}: priority {}, deadline {}, budget {}\n", name_of(now), now.priority,
            limit_text(now.deadline_ns), limit_text(now.budget_ns));
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  CLI::App* const set_command = command->add_subcommand(
      "set", "Changes the priority, deadline or budget of a callback; prints what is in force");
  set_command->add_option("CONTAINER", options->container, "The container's name")->required();
  set_command->add_option("CALLBACK", options->callback, "NODE/CALLBACK, as takt top shows it")
      ->required();
  set_command
      ->add_option("CHANGE", options->changes,
                   "priority=NUMBER, deadline=TIME or budget=TIME; all at once, between two "
                   "callbacks")
      ->required();
  options->domain.add_to(*set_command);
  set_command->callback([options] { set(*options); });
  command->footer(
      "Example:\n  takt callback set robot lidar/scan_timer priority=90 deadline=2ms\n");
}
const Command registered("callback", "Changes callbacks of running containers", set_up);

}  // namespace
}  // namespace takt::tools::callback_command
