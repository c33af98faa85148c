// SPDX-License-Identifier: Apache-2.0
#include "graph/type_finder.hpp"

#include <algorithm>
#include <chrono>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/entries.hpp"
#include "takt/messages/message_types.hpp"
#include "takt/messages/type_description_interfaces/srv/get_type_description.hpp"

#include "exit_status.hpp"
#include "graph/definitions.hpp"
#include "run/live_line.hpp"

namespace takt::tools {
namespace {

using type_description_interfaces::srv::GetTypeDescription;
using namespace std::chrono_literals;

constexpr auto kPatience = 2s;

bool is_message(const std::string& name) {
  return name.find("/msg/") != std::string::npos;
}

/// "std_srvs/srv/Trigger" of "std_srvs/srv/Trigger_Request".
std::string interface_of(const std::string& name) {
  const bool has_parts =
      name.find("/srv/") != std::string::npos || name.find("/action/") != std::string::npos;
  return has_parts && !is_message(name) ? name.substr(0, name.rfind('_')) : name;
}

/// A message type that a node announces.
struct Announced {
  std::string node, type, hash;
};

std::vector<Announced> announced_types(const Graph& graph) {
  std::vector<Announced> types;
  for (const auto* list : {&graph.publishers, &graph.subscriptions}) {
    for (const GraphEndpoint& end : *list) types.push_back({end.node, end.type, end.type_hash});
  }
  for (const auto* list : {&graph.services, &graph.clients}) {
    for (const GraphEndpoint& end : *list) {
      types.push_back({end.node, end.type + "_Request", end.type_hash});
      types.push_back({end.node, end.type + "_Response", end.response_hash});
    }
  }
  return types;
}

/// Names interfaces, as users do: Move, not the Move_Goal that it is made of.
[[noreturn]] void throw_unknown_type(const std::string& part) {
  std::set<std::string> packages, interfaces;
  const std::string name = interface_of(part);
  const std::string package = name.substr(0, name.find('/') + 1);
  for (const std::string& known : message_types().names()) {
    packages.insert(known.substr(0, known.find('/')));
    if (known.starts_with(package)) interfaces.insert(interface_of(known));
  }
  const std::vector<std::string> of_package(interfaces.begin(), interfaces.end());
  throw UsageError(
      fmt::format("takt does not know the type {}", name),
      !package.empty() && !of_package.empty()
          ? suggest(name, of_package)
          : fmt::format("name a library that registers it with --library, or a folder with its "
                        "definition in AMENT_PREFIX_PATH, or start a node that describes it{}; "
                        "without, takt knows the types of {}; `hz`, `bw` and `echo --raw` need "
                        "none",
                        is_message(name) ? "" : " (nodes of ROS 2 describe messages only)",
                        fmt::join(packages, ", ")));
}

}  // namespace

const MessageType& TypeFinder::require(const std::string& name) {
  if (const MessageType* type = find_here(name)) return *type;
  if (const MessageType* type = ask_nodes(name, interface_of(name))) return *type;
  throw_unknown_type(name);
}

const MessageType* TypeFinder::find_here(const std::string& name) {
  if (const MessageType* known = message_types().find(name)) return known;
  const auto description = as_usage([&] { return defined(interface_of(name)); });
  return description ? described(*description, name) : nullptr;
}

const MessageType* TypeFinder::described(const TypeDescription& description,
                                         const std::string& name) {
  const auto& types = descriptions_.emplace_back(std::make_unique<DescribedTypes>(description));
  return types->find(name);
}

const MessageType* TypeFinder::ask_nodes(const std::string& name, const std::string& interface) {
  // The message itself, or one that contains it: "…/Fibonacci_SendGoal_Request" contains the goal,
  // and the event of a service of ROS 2, if it publishes any, its request and response.
  const auto is_of_it = [&](const Announced& announced) {
    return announced.type == name || announced.type.starts_with(interface + "_");
  };
  const auto has_it = [&](const Graph& seen) {
    const std::vector<Announced> types = announced_types(seen);
    return std::any_of(types.begin(), types.end(), is_of_it);
  };
  // Others need to be discovered once only.
  const Graph graph = std::exchange(has_discovered_, true) ? observer_.participant()->graph()
                                                           : observer_.whole_graph(has_it);
  // Limit: nodes that a command asks for the description of a type, one after the other. At it: the
  // type is not known. Seen: the error.
  constexpr std::size_t kMostNodes = 20;
  std::set<std::string> servers, asked;
  for (const GraphEndpoint& service : graph.services) servers.insert(service.name);
  for (const Announced& announced : announced_types(graph)) {
    if (!is_of_it(announced)) continue;
    const auto& [node, type, hash] = announced;
    const std::string service = node + "/get_type_description";
    if (hash.empty() || !servers.contains(service) || !is_topic_name(service)) continue;
    if (asked.size() == kMostNodes) break;
    asked.insert(service);
    const auto description = ask(service, type, hash);
    if (!description) continue;
    if (const MessageType* found = described(*description, name)) return found;
  }
  return nullptr;
}

std::optional<TypeDescription> TypeFinder::ask(const std::string& service, const std::string& type,
                                               const std::string& hash) {
  const LiveLine line("asking for the type");
  const auto client = observer_.node().create_client<GetTypeDescription>(service);
  const TimePoint end = later(Clock::steady().now(), kPatience);
  while (!client->service_is_ready()) {
    if (Clock::steady().now() > end) return {};
    std::this_thread::sleep_for(5ms);
  }
  std::optional<TypeDescription> description;
  bool is_answered = false;
  client->async_send_request(
      GetTypeDescription::Request()
          .set__type_name(type)
          .set__type_hash(hash)
          .set__include_type_sources(false),
      [&](const GetTypeDescription::Response* response) {
        is_answered = true;
        if (response != nullptr && response->successful && why_too_long(*response).empty()) {
          description = response->type_description;
        }
      });
  WaitSet wait_set;
  wait_set.add(client);
  while (!is_answered && Clock::steady().now() < end) {
    wait_set.wait(end - Clock::steady().now());
    for (Slot slot; client->take(slot); slot = {}) client->execute(slot);
  }
  if (description && type_hash(*description) != hash) {
    rt::to_stderr("'{}' describes {} as a type with another hash\n", service, type);
    return {};
  }
  return description;
}

}  // namespace takt::tools
