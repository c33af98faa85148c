// takt lifecycle: shows and changes the state of lifecycle nodes.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <memory>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/printable.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/lifecycle_msgs/srv/change_state.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_available_transitions.hpp"
#include "takt/messages/lifecycle_msgs/srv/get_state.hpp"
#include "takt/nodes/lifecycle_state_machine.hpp"

#include "commands.hpp"
#include "graph/domain_option.hpp"
#include "graph/observer.hpp"
#include "graph/service_call.hpp"
#include "outputs.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::lifecycle_command {
namespace {

namespace lm = lifecycle_msgs::srv;
using nlohmann::json;

struct Options {
  DomainOption domain;
  std::string node, transition, json_path;
  bool all = false, counts = false;
};

std::string called(const std::string& node) {
  return fmt::format("lifecycle node '{}'", node);
}

std::string state_of(Caller& caller, const std::string& node) {
  return caller.call<lm::GetState>(service_of(node, "/get_state"), {}, called(node))
      .current_state.label;
}

auto transitions_of(Caller& caller, const std::string& node) {
  return caller
      .call<lm::GetAvailableTransitions>(service_of(node, "/get_available_transitions"), {},
                                         called(node))
      .available_transitions;
}

std::vector<std::string> labels_of(const auto& transitions) {
  std::vector<std::string> labels;
  for (const auto& description : transitions) labels.push_back(description.transition.label);
  return labels;
}

// Where it leads when it succeeds.
std::string_view state_after(const lifecycle_msgs::msg::TransitionDescription& transition) {
  const LifecycleTransition* known = find_transition(
      static_cast<LifecycleState>(transition.start_state.id), transition.transition.label);
  return known != nullptr ? label(find_result(known->goal, CallbackReturn::SUCCESS).goal)
                          : std::string_view(transition.goal_state.label);
}

// As ros2 lifecycle list.
void list_transitions(const Options& options) {
  Caller caller(options.domain.number());
  json rows = json::array();
  for (const auto& [transition, start, goal] : transitions_of(caller, options.node)) {
    rows.push_back({{"transition", transition.label},
                    {"id", transition.id},
                    {"start", start.label},
                    {"goal", goal.label}});
    if (options.json_path == "-") continue;
    rt::print("- {} [{}]\n\tStart: {}\n\tGoal: {}\n", printable(transition.label), transition.id,
              printable(start.label), printable(goal.label));
  }
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

void nodes(const Options& options) {
  std::vector<std::string> names;
  for (const std::string& node : Caller(options.domain.number()).find("/change_state")) {
    if (options.all || !is_hidden("/" + node)) names.push_back("/" + node);
  }
  if (options.counts) {
    rt::print("{}\n", names.size());
  } else {
    for (const std::string& name : names) rt::print("{}\n", name);
  }
}

void list(const Options& options) {
  if (!options.node.empty()) return list_transitions(options);
  Caller caller(options.domain.number());
  json rows = json::array();
  Table table({"node", "state", "can"});
  auto states =
      caller.ask_all<lm::GetState>(caller.find("/change_state"), "/get_state", {}, kListLimit);
  std::vector<std::string> nodes;
  for (const auto& [node, answer] : states.in_time) nodes.push_back(node);
  const auto transitions = caller.ask_all<lm::GetAvailableTransitions>(
      nodes, "/get_available_transitions", {}, kListLimit);
  std::map<std::string, std::vector<std::string>> can;
  for (const auto& [node, answer] : transitions.in_time) {
    can[node] = labels_of(answer.available_transitions);
  }
  for (const auto& [node, answer] : states.in_time) {
    const std::string& state = answer.current_state.label;
    table.add({"/" + node, state, fmt::format("{}", fmt::join(can[node], ", "))});
    rows.push_back({{"node", "/" + node}, {"state", state}, {"transitions", can[node]}});
  }
  std::vector<std::string>& silent = states.silent;
  silent.insert(silent.end(), transitions.silent.begin(), transitions.silent.end());
  if (rows.empty() && silent.empty()) {
    rt::to_stderr("no lifecycle node on DDS domain {}\n", options.domain.number());
  }
  if (options.json_path != "-") table.print("lifecycle nodes");
  if (!options.json_path.empty()) write_json(rows, options.json_path);
  Caller::name_silent("lifecycle node", silent, kListLimit);
}

void get(const Options& options) {
  Caller caller(options.domain.number());
  rt::print("{}\n", printable(state_of(caller, options.node)));
}

void set(const Options& options) {
  Caller caller(options.domain.number());
  const auto transitions = transitions_of(caller, options.node);
  const std::vector<std::string> can = labels_of(transitions);
  lm::ChangeState::Request request;
  request.transition.label = options.transition;
  const auto possible = std::find_if(
      transitions.begin(), transitions.end(),
      [&](const auto& description) { return description.transition.label == options.transition; });
  if (possible == transitions.end()) {
    throw Error(fmt::format("'{}' is '{}' and cannot {}", options.node,
                            state_of(caller, options.node), options.transition),
                suggest(options.transition, can));
  }
  const auto answer = caller.call<lm::ChangeState>(service_of(options.node, "/change_state"),
                                                   request, called(options.node));
  if (!answer.success) {
    throw Error(fmt::format("'{}' failed to {}", options.node, options.transition),
                "see its log for the reason");
  }
  // Not by another request: the answer tells that the transition has succeeded, and the node may
  // have been unloaded since.
  rt::print("{}\n", printable(state_after(*possible)));
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what, void (*function)(const Options&)) {
    CLI::App* sub = command->add_subcommand(name, what);
    options->domain.add_to(*sub);
    sub->callback([options, function] { function(*options); });
    return sub;
  };
  CLI::App* list_command =
      add("list", "Lists all lifecycle nodes with their states, or the transitions of one", list);
  list_command->add_option("NODE", options->node, "Its name, with its namespace");
  add_output(*list_command, "--json", options->json_path,
             "Also write the table as JSON; - for stdout");
  CLI::App* nodes_command = add("nodes", "Prints the names of all lifecycle nodes", nodes);
  nodes_command->add_flag("-a,--all", options->all,
                          "Include hidden nodes, whose names begin with '_'");
  nodes_command->add_flag("-c,--count-nodes", options->counts, "Print only their number");
  add("get", "Prints the state of a node", get)
      ->add_option("NODE", options->node, "Its name, with its namespace")
      ->required();
  CLI::App* set_command = add("set", "Requests a transition, and prints the new state", set);
  set_command->add_option("NODE", options->node, "Its name, with its namespace")->required();
  set_command
      ->add_option("TRANSITION", options->transition,
                   "configure, cleanup, activate, deactivate or shutdown")
      ->required();
  command->footer(
      "Example:\n"
      "  takt lifecycle list\n"
      "  takt lifecycle nodes\n"
      "  takt lifecycle get map_server\n"
      "  takt lifecycle set map_server activate\n");
}
const Command registered("lifecycle", "Shows and changes the state of lifecycle nodes", set_up);

}  // namespace
}  // namespace takt::tools::lifecycle_command
