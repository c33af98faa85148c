// takt component: lists component classes, and loads them into running containers.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>

#include <fmt/format.h>

#include "takt/base/printable.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/containers/set_callback_parameters.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/composition_interfaces/srv/list_nodes.hpp"
#include "takt/messages/composition_interfaces/srv/load_node.hpp"
#include "takt/messages/composition_interfaces/srv/unload_node.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter.hpp"
#include "takt/ros2/parameter_services.hpp"

#include "commands.hpp"
#include "graph/domain_option.hpp"
#include "graph/service_call.hpp"
#include "outputs.hpp"
#include "prompt/mistakes.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::component_command {
namespace {

namespace ci = composition_interfaces::srv;
using nlohmann::json;
using namespace std::chrono_literals;

constexpr const char* kList = "/_container/list_nodes";
constexpr const char* kLoad = "/_container/load_node";

struct Options {
  DomainOption domain;
  std::string container, json_path;
  std::vector<std::string> component;  // perhaps a package, and a class
  std::uint64_t id = 0;
  ci::LoadNode::Request request;
  std::vector<std::string> parameters, extra_arguments;
  std::string executor, library;
};

std::string called(const std::string& container) {
  return fmt::format("container '{}'", container);
}

void types(const Options& options) {
  const std::vector<IndexedComponent> index = component_index();
  json rows = json::array();
  Table table({"component", "library", "description"});
  const auto add = [&](const std::string& name, const std::string& library,
                       const std::string& description) {
    table.add({name, library.empty() ? "(takt)" : library, description});
    rows.push_back({{"component", name}, {"library", library}, {"description", description}});
  };
  for (const std::string& name : component_names()) add(name, "", components().description(name));
  for (const auto& [name, library] : index) add(name, library, "");
  if (options.json_path != "-") table.print("components");
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

void list(const Options& options) {
  Caller caller(options.domain.number());
  std::vector<std::string> containers{options.container};
  if (options.container.empty()) containers = caller.find(kList);
  json rows = json::array();
  Table table({"container", "id", "component"});
  if (!options.container.empty() &&
      !caller.finds<ci::ListNodes>(service_of(options.container, kList), 3s)) {
    caller.nobody(service_of(options.container, kList), called(options.container));
  }
  const auto answers = caller.ask_all<ci::ListNodes>(containers, kList, {}, kListLimit);
  auto servers = caller.servers();
  for (const auto& [container, answer] : answers.in_time) {
    const auto add_note = [&, name = container](const std::string& note) {
      table.add({name, "-", fmt::format("({})", note)});
      rows.push_back(
          {{"container", name}, {"id", nullptr}, {"component", nullptr}, {"note", note}});
    };
    if (answer.unique_ids.empty()) add_note("empty");
    // Both have answered, and one answer was taken.
    for (std::size_t others = servers[service_of(container, kList)]; others > 1; --others) {
      add_note("another process has a container of this name");
    }
    for (std::size_t i = 0; i < std::min(answer.unique_ids.size(), answer.full_node_names.size());
         ++i) {
      table.add({container, std::to_string(answer.unique_ids[i]), answer.full_node_names[i]});
      rows.push_back({{"container", container},
                      {"id", answer.unique_ids[i]},
                      {"component", answer.full_node_names[i]}});
    }
  }
  if (options.json_path != "-") {
    if (containers.empty())
      rt::to_stderr("no container on DDS domain {}\n", options.domain.number());
    table.print("components");
  }
  if (!options.json_path.empty()) write_json(rows, options.json_path);
  Caller::name_silent("container", answers.silent, kListLimit);
}

// The notation gives the type: 1, 1.0, true, [1, 2], word.
rcl_interfaces::msg::Parameter parameter(const std::string& text) {
  const std::size_t middle = text.find(":=");
  if (middle == std::string::npos || middle == 0) {
    throw Error(fmt::format("'{}' is not a parameter", text), "write name:=value");
  }
  document::Errors errors(text);
  document::Value parsed =
      document::parse_yaml(text.substr(middle + 2), errors, document::Rules::parameters);
  errors.throw_if_any();
  parsed.name = text.substr(0, middle);
  const std::optional<ParameterValue> value = read_parameter(parsed, errors);
  errors.throw_if_any();
  return rcl_interfaces::msg::Parameter().set__name(parsed.name).set__value(to_message(*value));
}

// A container of ROS 2 looks for the class in the index of its package, and ends when the package
// has no name. What else it does not know, it would ignore.
bool needs_takt(const Options& options) {
  return options.request.package_name.empty() || !options.executor.empty() ||
         !options.library.empty();
}

[[noreturn]] void refuse_ros2(const Options& options) {
  const std::string container = called(options.container);
  if (options.request.package_name.empty()) {
    throw Error(
        fmt::format("{} is one of ROS 2, which finds components by their package", container),
        fmt::format("write: takt component load {} PACKAGE {}", options.container,
                    options.request.plugin_name));
  }
  throw Error(fmt::format("{} is one of ROS 2, which has no named executors, and loads libraries "
                          "by their index only",
                          container),
              "leave out --executor and --library");
}

void load(Options& options) {
  ci::LoadNode::Request& request = options.request;
  request.plugin_name = options.component.back();
  if (options.component.size() == 2) request.package_name = options.component.front();
  for (const std::string& text : options.parameters) request.parameters.push_back(parameter(text));
  for (const std::string& text : options.extra_arguments) {
    request.extra_arguments.push_back(parameter(text));
  }
  const auto add = [&](const char* name, const std::string& value) {
    if (value.empty()) return;
    request.extra_arguments.push_back(
        rcl_interfaces::msg::Parameter().set__name(name).set__value(to_message(value)));
  };
  add("executor", options.executor);
  add("library", options.library);
  Caller caller(options.domain.number());
  const std::string load_node = service_of(options.container, kLoad);
  caller.check_is_one(load_node, called(options.container));
  if (needs_takt(options) && caller.finds<ci::LoadNode>(load_node, 3s) &&
      !caller.finds<SetCallbackParameters>(
          service_of(options.container, "/set_callback_parameters"), 500ms)) {
    refuse_ros2(options);
  }
  const auto answer = caller.call<ci::LoadNode>(load_node, request, called(options.container));
  if (!answer.success) throw Error(answer.error_message);
  rt::print("{} {}\n", answer.unique_id, printable(answer.full_node_name));
}

void unload(const Options& options) {
  Caller caller(options.domain.number());
  const std::string unload_node = service_of(options.container, "/_container/unload_node");
  caller.check_is_one(unload_node, called(options.container));
  const auto answer = caller.call<ci::UnloadNode>(
      unload_node, ci::UnloadNode::Request().set__unique_id(options.id), called(options.container));
  if (!answer.success) throw Error(answer.error_message);
}

/// Shows the package and the class, which CLI11 would call COMPONENT(1x).
class LoadFormatter final : public HelpFormatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    return is_component(*option) ? "[PACKAGE] CLASS"
                                 : HelpFormatter::make_option_name(option, is_positional);
  }
  std::string make_option_usage(const CLI::Option* option) const override {
    return is_component(*option) ? make_option_name(option, true)
                                 : HelpFormatter::make_option_usage(option);
  }

 private:
  static bool is_component(const CLI::Option& option) {
    return option.get_positional() && option.get_expected_max() == 2;
  }
};

void add_load_options(CLI::App* command, Options& options) {
  command->add_option("CONTAINER", options.container, "The container's name")->required();
  command
      ->add_option("COMPONENT", options.component,
                   "The component (see: takt component types); only ROS 2's containers need the "
                   "package")
      ->required()
      ->type_name("")
      ->expected(1, 2);
  command->add_option("--name", options.request.node_name, "The node's name");
  command->add_option("--namespace", options.request.node_namespace, "The node's namespace");
  command->add_option(
      "--library", options.library,
      "The library of a class that is not in the index; the container must allow it "
      "(see: load in the configuration, takt run --load)");
  command->add_option("--executor", options.executor, "Name of an executor in the container");
  command->add_option("-p,--param", options.parameters, "name:=value; may be repeated")
      ->allow_extra_args(false);
  command->add_option("-r,--remap", options.request.remap_rules, "from:=to; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("-e,--extra", options.extra_arguments,
                   "callback_group.NAME.KEY:=value, on_exception:=…; may be repeated")
      ->allow_extra_args(false);
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what, void (*function)(Options&),
                       bool has_domain = true) {
    CLI::App* sub = command->add_subcommand(name, what);
    if (has_domain) options->domain.add_to(*sub);
    sub->callback([options, function] { function(*options); });
    return sub;
  };
  const auto add_json = [&](CLI::App* sub) {
    add_output(*sub, "--json", options->json_path, "Also write the table as JSON; - for stdout");
  };

  add_json(add(
      "types", "Lists the component classes of the component index", [](Options& o) { types(o); },
      false));
  CLI::App* list_command =
      add("list", "Lists the components of one container, or of all", [](Options& o) { list(o); });
  list_command->add_option("CONTAINER", options->container,
                           "The container's name (default: all containers)");
  add_json(list_command);

  CLI::App* load_command = add("load", "Loads a component; prints its ID and its node's name",
                               [](Options& o) { load(o); });
  add_load_options(load_command, *options);
  load_command->formatter(std::make_shared<LoadFormatter>());

  CLI::App* unload_command = add("unload", "Unloads a component", [](Options& o) { unload(o); });
  unload_command->add_option("CONTAINER", options->container, "The container's name")->required();
  unload_command->add_option("ID", options->id, "The component's ID (see: takt component list)")
      ->required();
  command->footer(
      "Example:\n"
      "  takt component types\n"
      "  takt run --name robot --executor events &\n"
      "  takt component load robot takt::Workload --name sender\n"
      "  takt component list robot\n"
      "  takt component unload robot 1\n");
}
const Command registered("component", "Lists components, and loads them into running containers",
                         set_up);

}  // namespace
}  // namespace takt::tools::component_command
