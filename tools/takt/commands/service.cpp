// takt service: lists and calls the services on the domain.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <regex>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/executors/wait_set.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "graph/dynamic_client.hpp"
#include "graph/dynamic_message.hpp"
#include "graph/observer.hpp"
#include "graph/type_finder.hpp"
#include "prompt/values.hpp"
#include "run/live_line.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::service_command {
namespace {

using nlohmann::json;

struct Options : ObserverOptions {
  std::string service, type;
  std::vector<std::string> words;  // of a call: [TYPE] [REQUEST]
  Nanoseconds timeout = std::chrono::seconds(5);
  bool shows_types = false, counts = false;
};

std::set<std::string> types_of(const std::vector<GraphEndpoint>& ends) {
  std::set<std::string> types;
  for (const GraphEndpoint& end : ends) types.insert(end.type);
  return types;
}

/// When there is a service for which `is_meant`, or after some time.
template <class IsMeant>
Graph graph_with(const Options& options, IsMeant is_meant) {
  return Observer(options).whole_graph([&](const Graph& seen) {
    return std::any_of(seen.services.begin(), seen.services.end(), is_meant);
  });
}

Graph graph_with_service(const Options& options, const std::string& name) {
  return graph_with(options, [&](const GraphEndpoint& service) { return service.name == name; });
}

void list(const Options& options) {
  const auto is_shown = [&](const GraphEndpoint& service) {
    return options.all || !is_hidden(service.name);
  };
  const Graph graph = graph_with(options, is_shown);
  const bool prints = options.json_path != "-";
  std::map<std::string, std::set<std::string>> types;
  Table table({"service", "type", "node"});
  json rows = json::array();
  for (const GraphEndpoint& service : graph.services) {
    if (!is_shown(service)) continue;
    types[service.name].insert(service.type);
    table.add({service.name, service.type, service.node.empty() ? "?" : service.node});
    rows.push_back({{"service", service.name}, {"type", service.type}, {"node", service.node}});
  }
  if (rows.empty()) rt::to_stderr("no service on DDS domain {}\n", options.domain.number());
  if (prints && options.shows_types) {
    for (const auto& [name, of] : types) rt::print("{} [{}]\n", name, fmt::join(of, ", "));
  } else if (prints) {
    table.print("services");
  }
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

/// Throws Error if nobody serves it.
std::set<std::string> require_types(const Graph& graph, const std::string& name) {
  const auto types = types_of(ends_of(graph.services, name));
  if (types.empty()) type_of(graph.services, {}, name, "service");  // throws
  return types;
}

void type(const Options& options) {
  const std::string name = absolute(options.service);
  for (const std::string& each : require_types(graph_with_service(options, name), name)) {
    rt::print("{}\n", each);
  }
}

void find(const Options& options) {
  const auto is_meant = [&](const GraphEndpoint& service) {
    return service.type == options.type && (options.all || !is_hidden(service.name));
  };
  std::set<std::string> names;
  for (const GraphEndpoint& service : graph_with(options, is_meant).services) {
    if (is_meant(service)) names.insert(service.name);
  }
  if (options.counts) {
    rt::print("{}\n", names.size());
  } else {
    for (const std::string& name : names) rt::print("{}\n", name);
  }
}

void info(const Options& options) {
  const std::string name = absolute(options.service);
  const Graph graph = graph_with_service(options, name);
  const auto types = require_types(graph, name);
  const std::size_t clients = ends_of(graph.clients, name).size(),
                    services = ends_of(graph.services, name).size();
  if (options.json_path != "-") {
    rt::print("Type: {}\nClients count: {}\nServices count: {}\n", fmt::join(types, ", "), clients,
              services);
  }
  const json row{{"service", name}, {"types", types}, {"clients", clients}, {"services", services}};
  if (!options.json_path.empty()) write_json(row, options.json_path);
}

/// "std_srvs/srv/Trigger", which is no YAML of a request.
bool is_type(const std::string& word) {
  static const std::regex kType("[A-Za-z][A-Za-z0-9_]*/(srv|action)/[A-Za-z][A-Za-z0-9_]*");
  return std::regex_match(word, kType);
}

void call(const Options& options) {
  const std::string name = absolute(options.service);
  const Observer observer(options);
  const Graph graph = observer.graph([&](const Graph& seen) {
    return std::any_of(seen.services.begin(), seen.services.end(),
                       [&](const auto& service) { return service.name == name; });
  });
  const bool has_type = !options.words.empty() && is_type(options.words.front());
  if (options.words.size() == 2 && !has_type) {
    throw Error(fmt::format("'{}' is not a type of a service", options.words.front()),
                "write SERVICE [TYPE] [REQUEST], with a type like std_srvs/srv/Trigger");
  }
  const std::string type = has_type               ? options.words.front()
                           : options.type.empty() ? type_of(graph.services, {}, name, "service")
                                                  : options.type;
  const std::string values = options.words.size() > has_type ? options.words.back() : "{}";
  TypeFinder finder(observer);
  const MessageType& request = finder.require(type + "_Request");
  const MessageType& response = finder.require(type + "_Response");
  std::optional<LiveLine> line(std::in_place, "waiting for an answer");
  bool is_answered = false;
  DynamicClient client(observer, name, request, response,
                       [&](const nlohmann::ordered_json& fields) {
                         is_answered = true;
                         line.reset();
                         if (options.json_path != "-") rt::print("{}", to_yaml(fields));
                         if (!options.json_path.empty()) write_json(fields, options.json_path);
                       });
  const ByteBuffer message = write_message(request, values, client.header());
  const TimePoint end = later(Clock::steady().now(), options.timeout);
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
    throw Error(fmt::format("no response from '{}' within {}", name, to_string(options.timeout)),
                "check that the server is not busy or stopped");
  }
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what, void (*function)(const Options&),
                       bool has_json) {
    CLI::App* sub = command->add_subcommand(name, what);
    add_observer_options(*sub, *options, has_json);
    sub->callback([options, function] { function(*options); });
    return sub;
  };
  const auto add_one = [&](const char* name, const char* what, void (*function)(const Options&),
                           bool has_json) {
    CLI::App* sub = add(name, what, function, has_json);
    sub->add_option("SERVICE", options->service, "Its name")->required();
    return sub;
  };
  const auto add_all = [&](CLI::App* sub) {
    sub->add_flag("-a,--all", options->all,
                  "Include hidden services, for example those of actions");
    return sub;
  };
  add_all(add("list", "Lists all services", list, true))
      ->add_flag("-t,--show-types", options->shows_types,
                 "Print NAME [TYPE] of each, as ros2 does");
  add_one("type", "Prints the type of a service", type, false);
  add_one("info", "Prints the type of a service, and how many clients and servers it has", info,
          true);
  CLI::App* find_command = add_all(add("find", "Prints the services of a type", find, false));
  find_command->add_option("TYPE", options->type, "The type, for example std_srvs/srv/Trigger")
      ->required();
  find_command->add_flag("-c,--count-services", options->counts, "Print only their number");
  CLI::App* call_command = add_one("call", "Calls a service, and prints the response", call, true);
  add_library_option(*call_command, options->libraries);
  call_command
      ->add_option("[TYPE] [REQUEST]", options->words,
                   "The type, if discovery does not report it, and the request as YAML; missing "
                   "fields are zero")
      ->expected(0, 2);
  call_command->add_option("--type", options->type, "The type, if discovery does not report it");
  add_time_option(*call_command, "--timeout", options->timeout,
                  "Time limit of the whole call (default: 5s)");
  command->footer(
      "Example:\n"
      "  takt service list\n"
      "  takt service type /reset\n"
      "  takt service info /reset\n"
      "  takt service find std_srvs/srv/Trigger\n"
      "  takt service call /lidar/get_parameters '{names: [rate_hz]}'\n"
      "  takt service call /reset std_srvs/srv/Trigger\n"
      "  takt service call /calibrate '{offset: 0.5}' --library libweather.so\n");
}
const Command registered("service", "Lists and calls services on a DDS domain, including ROS 2's",
                         set_up);

}  // namespace
}  // namespace takt::tools::service_command
