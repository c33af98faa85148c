// takt callback: changes callbacks of running containers.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
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

/// As the file writes it: "priority: 9, deadline: 2ms". The container checks the values; here they
/// only must be one word each.
std::string changes_of(const std::vector<std::string>& words) {
  static const std::vector<std::string> kKeys{"priority", "deadline", "budget"};
  std::string text;
  for (const std::string& word : words) {
    const std::size_t middle = std::min(word.find('='), word.size());
    const std::string key = word.substr(0, middle);
    if (middle == word.size()) {
      throw UsageError(fmt::format("'{}' is not a change", word), "write KEY=VALUE: priority=9");
    }
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
      throw UsageError(fmt::format("'{}' cannot be changed", key), suggest(key, kKeys));
    }
    const std::string value = word.substr(middle + 1);
    const auto is_plain = [](unsigned char character) {
      return std::isalnum(character) != 0 || character == '.' || character == '-';
    };
    if (value.empty() || !std::all_of(value.begin(), value.end(), is_plain)) {
      throw UsageError(fmt::format("'{}' is not a value of '{}'", value, key),
                       "write a number, or a time with its unit: deadline=2ms");
    }
    text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", key, value);
  }
  return text;
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
