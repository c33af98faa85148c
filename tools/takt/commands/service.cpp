// takt service: lists and calls the services on the domain.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <thread>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/executors/wait_set.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "graph/dynamic_client.hpp"
#include "graph/dynamic_message.hpp"
#include "graph/observer.hpp"
#include "graph/type_finder.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::service_command {
namespace {

using nlohmann::json;

struct Options : ObserverOptions {
  std::string service, type, request = "{}";
  double timeout_s = 5;
};

void list(const Options& options) {
  const auto is_shown = [&](const GraphEndpoint& service) {
    return options.all || !is_hidden(service.name);
  };
  const Graph graph = Observer(options).whole_graph([&](const Graph& seen) {
    return std::any_of(seen.services.begin(), seen.services.end(), is_shown);
  });
  Table table({"service", "type", "node"});
  json rows = json::array();
  for (const GraphEndpoint& service : graph.services) {
    if (!is_shown(service)) continue;
    table.add({service.name, service.type, service.node.empty() ? "?" : service.node});
    rows.push_back({{"service", service.name}, {"type", service.type}, {"node", service.node}});
  }
  if (rows.empty()) rt::to_stderr("no service on DDS domain {}\n", options.domain.number());
  if (options.json_path != "-") table.print("services");
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

void call(const Options& options) {
  const std::string name = absolute(options.service);
  const Observer observer(options);
  const Graph graph = observer.graph([&](const Graph& seen) {
    return std::any_of(seen.services.begin(), seen.services.end(),
                       [&](const auto& service) { return service.name == name; });
  });
  const std::string type =
      options.type.empty() ? type_of(graph.services, {}, name, "service") : options.type;
  TypeFinder finder(observer);
  const MessageType& request = finder.require(type + "_Request");
  const MessageType& response = finder.require(type + "_Response");
  bool is_answered = false;
  DynamicClient client(observer, name, request, response,
                       [&](const nlohmann::ordered_json& fields) {
                         is_answered = true;
                         if (options.json_path != "-") rt::print("{}", to_yaml(fields));
                         if (!options.json_path.empty()) write_json(fields, options.json_path);
                       });
  const ByteBuffer message = write_message(request, options.request, client.header());
  const Nanoseconds limit(static_cast<std::int64_t>(options.timeout_s * 1e9));
  const TimePoint end = later(Clock::steady().now(), limit);
  while (!client.service_is_ready()) {
    if (Clock::steady().now() > end) {
      throw Error(fmt::format("service '{}' has no server", name),
                  "check that the server runs on the same DDS domain (--domain, ROS_DOMAIN_ID)");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  WaitSet wait_set;
  wait_set.add(client.responses());
  client.send(message.bytes());
  while (!is_answered) {
    if (wait_set.wait(std::max(end - Clock::steady().now(), Nanoseconds::zero())).empty()) break;
    for (Slot slot; client.responses()->take(slot);) client.responses()->execute(slot);
  }
  if (!is_answered) {
    throw Error(fmt::format("no response from '{}' within {}", name, to_string(limit)),
                "check that the server is not busy or stopped");
  }
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  CLI::App* list_command = command->add_subcommand("list", "Lists all services");
  add_observer_options(*list_command, *options);
  list_command->add_flag("-a,--all", options->all,
                         "Include hidden services, for example those of actions");
  list_command->callback([options] { list(*options); });
  CLI::App* call_command =
      command->add_subcommand("call", "Calls a service, and prints the response");
  add_observer_options(*call_command, *options);
  add_library_option(*call_command, options->libraries);
  call_command->add_option("SERVICE", options->service, "Its name")->required();
  call_command->add_option("REQUEST", options->request,
                           "The request as YAML; missing fields are zero");
  call_command->add_option("--type", options->type, "The type, if discovery does not report it");
  call_command->add_option("--timeout", options->timeout_s, "Time limit in seconds")
      ->check(CLI::PositiveNumber);
  call_command->callback([options] { call(*options); });
  command->footer(
      "Example:\n"
      "  takt service list\n"
      "  takt service call /lidar/get_parameters '{names: [rate_hz]}'\n"
      "  takt service call /calibrate '{offset: 0.5}' --library libweather.so\n");
}
const Command registered("service", "Lists and calls services on a DDS domain, including ROS 2's",
                         set_up);

}  // namespace
}  // namespace takt::tools::service_command
