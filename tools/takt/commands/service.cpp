// takt service: lists and calls the services on the domain.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstring>
#include <iterator>
#include <memory>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/entities/generic_publisher.hpp"
#include "takt/entities/generic_subscription.hpp"
#include "takt/entities/service_message.hpp"
#include "takt/executors/wait_set.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "graph/dynamic_message.hpp"
#include "graph/observer.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

struct Options : ObserverOptions {
  std::string service, type, request = "{}";
  double timeout_s = 5;
};

void list(const Options& options) {
  const Graph graph = Observer(options).graph();
  Table table({"service", "type", "node"});
  json rows = json::array();
  for (const GraphEndpoint& service : graph.services) {
    if (is_hidden(service.name) && !options.all) continue;
    table.add({service.name, service.type, service.node.empty() ? "?" : service.node});
    rows.push_back({{"service", service.name}, {"type", service.type}, {"node", service.node}});
  }
  if (rows.empty()) rt::to_stderr("no service on DDS domain {}\n", options.domain);
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
  const MessageType& request = require_type(type + "_Request");
  const MessageType& response = require_type(type + "_Response");
  struct {
    std::uint64_t client = new_client_id();
    std::int64_t sequence = 1;
  } const id;
  std::array<std::byte, sizeof id> header{};
  std::memcpy(header.data(), &id, sizeof id);
  const ByteBuffer message = write_message(request, options.request, header);

  // Node rejects the names of the client's topics, so create the endpoints without it.
  const std::string node = observer.node().fully_qualified_name();
  const ServiceIdentity identity{new_service_id(kClientId), &request, &response};
  bool is_answered = false;
  const auto answers = std::make_shared<GenericSubscription>(
      name, observer.node().default_callback_group(),
      Endpoint{reply_topic(name), &serialized_type(response.name), QoS(10), node, identity},
      [&](std::span<const std::byte> bytes, const MessageInfo&) {
        is_answered = true;
        const auto fields = read_message(response, bytes, {.skipped = sizeof id});
        if (options.json_path != "-") fmt::print("{}", to_yaml(fields));
        if (!options.json_path.empty()) write_json(fields, options.json_path);
      },
      observer.participant());
  answers->set_address(id.client);
  answers->start();
  GenericPublisher requests(
      {request_topic(name), &serialized_type(request.name), QoS(10), node, identity},
      Clock::steady(), observer.participant());
  const Nanoseconds limit(static_cast<std::int64_t>(options.timeout_s * 1e9));
  const TimePoint end = Clock::steady().now() + limit;
  while (requests.subscription_count() == 0 || answers->outside_publisher_count() == 0) {
    if (Clock::steady().now() > end) {
      throw Error(fmt::format("service '{}' has no server", name),
                  "check that the server runs on the same DDS domain (--domain, ROS_DOMAIN_ID)");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  WaitSet wait_set;
  wait_set.add(answers);
  requests.publish(message.bytes());
  while (!is_answered) {
    if (wait_set.wait(std::max(end - Clock::steady().now(), Nanoseconds::zero())).empty()) break;
    for (Slot slot; answers->take(slot);) answers->execute(slot);
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
      "  takt service call /lidar/get_parameters '{names: [rate_hz]}'\n");
}
const Command registered("service", "Lists and calls services on a DDS domain, including ROS 2's",
                         set_up);

}  // namespace
}  // namespace takt::tools
