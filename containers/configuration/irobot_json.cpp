// Reads the workload format of irobot-ros/ros2-performance.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/nodes/node.hpp"
#include "takt/transport/qos.hpp"

namespace takt {
namespace {

constexpr const char* kWorkload = "takt::Workload";

struct MessageSize {
  std::string_view type;
  std::int64_t bytes;  // kVariable: the publisher says it
};
constexpr std::int64_t kVariable = -1;
constexpr std::array<MessageSize, 21> kMessageSizes{
    {{"stamped10b", 10},       {"stamped100b", 100},     {"stamped250b", 250},
     {"stamped1kb", 1024},     {"stamped10kb", 10240},   {"stamped50kb", 51200},
     {"stamped100kb", 102400}, {"stamped250kb", 256000}, {"stamped500kb", 512000},
     {"stamped600kb", 614400}, {"stamped1mb", 1048576},  {"stamped4mb", 4194304},
     {"stamped5mb", 5120000},  {"stamped8mb", 8388608},  {"stamped3_float32", 12},
     {"stamped4_float32", 16}, {"stamped9_float32", 36}, {"stamped12_float32", 48},
     {"stamped4_int32", 16},   {"stamped_int64", 8},     {"stamped_vector", kVariable}}};

std::vector<std::string> message_types() {
  std::vector<std::string> types;
  for (const MessageSize& known : kMessageSizes) types.emplace_back(known.type);
  return types;
}

std::int64_t size_of(std::string_view type) {
  return std::find_if(kMessageSizes.begin(), kMessageSizes.end(),
                      [&](const MessageSize& known) { return known.type == type; })
      ->bytes;
}

/// A publisher or a subscription; of a client or a server the topic is the service.
struct JsonEndpoint {
  std::string topic;  // or the service
  std::string type;
  std::string pass_by;
  int size_bytes = 0;
  std::int64_t period_us = 0;
  int depth = 10;
  std::string reliability = "reliable", durability = "volatile";
};

class WorkloadReader : private SystemReader {
 public:
  explicit WorkloadReader(Reading& file) : SystemReader(file) {}

  SystemDescription read(const Value& root) {
    errors_.passes(root.line, [] { components().check(kWorkload); });
    read_file(root);
    return std::move(system_);
  }

  std::vector<ReferenceSection> describe_file() {
    return describe([this](const Value& root) { read_file(root); });
  }

 private:
  void read_file(const Value& root) {
    read_root(root, "the file",
              {{"nodes", "Not empty.", [this](const Value& nodes) { read_nodes(nodes); }, true}});
  }

  // ---- Nodes ----

  void read_nodes(const Value& nodes) {
    each_in_list([this](const Value& node) { read_node(node); })(nodes);
    const auto* list = std::get_if<document::List>(&nodes.content);
    if (list != nullptr && list->empty()) {
      errors_.add(nodes.line, "the list of nodes is empty", "describe at least one");
    }
  }

  void read_node(const Value& value) {
    ComponentDescription node{.type = kWorkload, .where = errors_.where(value.line)};
    const bool has_number = document::find(value, "number") != nullptr;
    int copies = 1;
    int executor_id = 0;
    read_map(value, "a node",
             {{"node_name", "Its name.", into_node_name(node.name), true},
              {"node_namespace", "Its namespace, for example `/front`. By default, the root.",
               into_name_space(node.name_space)},
              {"number",
               "Number of copies of the node. Their names get the suffixes `_1`, `_2` and so on.",
               into(copies, 1, static_cast<int>(document::kMaxValues))},
              {"executor_id",
               "Nodes with the same id share a `single_threaded` executor named `executor_<id>`.",
               into(executor_id, 0)},
              {"publishers", "Its publishers.",
               each_in_list([&](const Value& publisher) { read_publisher(publisher, node); })},
              {"subscribers", "Its subscriptions.",
               each_in_list([&](const Value& subscriber) { read_subscriber(subscriber, node); })},
              {"clients", "Its service clients.",
               each_in_list([&](const Value& client) { read_client(client, node); })},
              {"servers", "Its service servers.",
               each_in_list([&](const Value& server) { read_server(server, node); })}});
    // The limit on the number of values includes all copies.
    const auto factor = static_cast<std::size_t>(copies);
    values_ += factor * document::count(value);
    if (values_ > document::kMaxValues) {
      errors_.fail(value.line,
                   fmt::format("with all copies of nodes these are more than {} values",
                               document::kMaxValues),
                   "ask for fewer copies");
    }
    node.executor = executor_for(executor_id, value.line);
    if (!has_number) return add(std::move(node), value.line);
    for (int i = 1; i <= copies; ++i) add(copy(node, i), value.line);
  }

  static ComponentDescription copy(const ComponentDescription& node, int number) {
    ComponentDescription result = node;
    const std::string suffix = fmt::format("_{}", number);
    if (!node.name.empty()) result.name += suffix;  // a missing name is an error already
    if (!node.name_space.empty()) result.name_space += suffix;
    return result;
  }

  std::string executor_for(int id, int line) {
    const std::string name = fmt::format("executor_{}", id);
    if (executor_ids_.insert(id).second) {
      ExecutorDescription& executor = system_.executors.emplace_back();
      executor.name = name;
      executor.where = errors_.where(line);
    }
    return name;
  }

  // ---- What a node has ----

  void read_publisher(const Value& value, ComponentDescription& node) {
    JsonEndpoint publisher{.pass_by = "unique_ptr"};
    std::vector<Field> fields = topic_fields(publisher);
    add_rate(fields, publisher);
    fields.push_back({"msg_size",
                      "Size in bytes. Required for `stamped_vector`, invalid otherwise.",
                      into(publisher.size_bytes, 0)});
    read_map(value, "a publisher", fields);
    check_rate(value, "a publisher");
    check_topic(value, publisher, node);
    if (!publisher.type.empty()) set_size(value, publisher);
    append(value, node, "publishers", publisher);
    append<std::int64_t>(value, node, "publishers.size_bytes", publisher.size_bytes);
    append(value, node, "publishers.period_us", publisher.period_us);
  }

  void read_subscriber(const Value& value, ComponentDescription& node) {
    JsonEndpoint subscription{.pass_by = "shared_ptr"};
    read_map(value, "a subscriber", topic_fields(subscription));
    check_topic(value, subscription, node);
    append(value, node, "subscriptions", subscription);
  }

  void read_client(const Value& value, ComponentDescription& node) {
    JsonEndpoint client;
    std::vector<Field> fields = service_fields(client);
    add_rate(fields, client);
    read_map(value, "a client", fields);
    check_rate(value, "a client");
    append(value, node, "clients.service", client.topic);
    append(value, node, "clients.period_us", client.period_us);
  }

  void read_server(const Value& value, ComponentDescription& node) {
    JsonEndpoint server;
    read_map(value, "a server", service_fields(server));
    append(value, node, "servers.service", server.topic);
  }

  void append(const Value& value, ComponentDescription& node, const std::string& kind,
              const JsonEndpoint& endpoint) {
    append(value, node, kind + ".topic", endpoint.topic);
    append(value, node, kind + ".pass_by", endpoint.pass_by);
    append<std::int64_t>(value, node, kind + ".depth", endpoint.depth);
    append(value, node, kind + ".reliability", endpoint.reliability);
    append(value, node, kind + ".durability", endpoint.durability);
  }

  template <class T>
  void append(const Value& value, ComponentDescription& node, const std::string& name, T item) {
    node.parameter_lines.try_emplace(name, errors_.where(value.line));
    auto& array = node.parameters.try_emplace(name, std::vector<T>()).first->second;
    std::get<std::vector<T>>(array).push_back(std::move(item));
  }

  // ---- Keys ----

  std::vector<Field> topic_fields(JsonEndpoint& endpoint) {
    std::vector<Field> fields{
        {"topic_name", "The topic.", into_topic(endpoint.topic), true},
        {"msg_type",
         "The message type, optionally after a plugin name and `::`. A topic has one type.",
         into_type(endpoint.type, message_types()), true},
        {"msg_pass_by", "How the message is passed.",
         into(endpoint.pass_by, {{"unique_ptr", "unique_ptr"},
                                 {"shared_ptr", "shared_ptr"},
                                 {"loaned_msg", "loaned_msg"}})}};
    add_qos(fields, endpoint);
    return fields;
  }

  std::vector<Field> service_fields(JsonEndpoint& endpoint) {
    std::vector<Field> fields{{"service_name", "The service.", into_topic(endpoint.topic), true},
                              {"srv_type", "Its type, optionally after a plugin name and `::`.",
                               into_type(endpoint.type, {"stamped10b"}), true}};
    add_qos(fields, endpoint);
    return fields;
  }

  void add_rate(std::vector<Field>& fields, JsonEndpoint& endpoint) {
    // The last field takes precedence.
    fields.push_back({"period_ms", "The period. Either this key or `freq_hz` is required.",
                      into_period(endpoint, [](double ms) { return ms * 1e3; })});
    fields.push_back({"freq_hz", "The frequency. It takes precedence over `period_ms`.",
                      into_period(endpoint, [](double hz) { return 1e6 / hz; })});
  }

  void add_qos(std::vector<Field>& fields, JsonEndpoint& endpoint) {
    const std::vector<Field> qos{
        {"qos_depth", "Number of messages kept.",
         [this, &endpoint](const Value& value) {
           into(endpoint.depth, 0)(value);
           errors_.passes(value.line,
                          [&] { QoS(static_cast<std::size_t>(endpoint.depth)).check(); });
         }},
        {"qos_history", "`keep_all`: equal to `qos_depth: 16384`; `qos_depth` is ignored.",
         [this, &endpoint](const Value& value) {
           if (choose(value, {"keep_last", "system_default", "keep_all"}, "keep_last") == 2) {
             endpoint.depth = static_cast<int>(QoS().keep_all().depth);
           }
         }},
        {"qos_reliability", "`system_default` is `reliable`.",
         into(endpoint.reliability, {{"reliable", "reliable"},
                                     {"best_effort", "best_effort"},
                                     {"system_default", "reliable"}})},
        {"qos_durability", "`system_default` is `volatile`.",
         into(endpoint.durability, {{"volatile", "volatile"},
                                    {"transient_local", "transient_local"},
                                    {"system_default", "volatile"}})},
        // Liveliness leases never expire in this workload, so the kind makes no difference.
        {"qos_liveliness", "Accepted, but has no effect.",
         accept({"automatic", "manual_by_topic", "system_default"})},
        {"qos_deadline", "Accepted, but has no effect.", accept({"default"})},
        {"qos_lifespan", "Accepted, but has no effect.", accept({"default"})},
        {"qos_liveliness_lease_duration", "Accepted, but has no effect.", accept({"default"})},
        {"qos_avoid_ros_namespace_conventions", "Accepted, but has no effect.",
         accept({"true", "false"})}};
    fields.insert(fields.end(), qos.begin(), qos.end());
  }

  // Accepts a word that does not change anything.
  Read accept(std::vector<std::string> words) {
    return [this, words = std::move(words)](const Value& value) { choose(value, words); };
  }

  // "type" or "plugin::type".
  Read into_type(std::string& target, std::vector<std::string> types) {
    return [this, &target, types = std::move(types)](const Value& value) {
      if (is_describing()) return static_cast<void>(choose(value, types));
      std::string text;
      into(text)(value);
      if (text.empty()) return;
      const std::size_t colons = text.rfind("::");
      const std::string type = colons == std::string::npos ? text : text.substr(colons + 2);
      if (std::find(types.begin(), types.end(), type) != types.end()) {
        target = type;
      } else {
        errors_.add(value.line, fmt::format("'{}' cannot be '{}'", value.name, type),
                    suggest(type, types));
      }
    };
  }

  Read into_period(JsonEndpoint& endpoint, const std::function<double(double)>& microseconds) {
    return [this, &endpoint, microseconds](const Value& value) {
      if (describes("number")) return;
      double number = std::nan("");
      into(number)(value);
      if (std::isnan(number)) return;
      // Round to whole microseconds: truncation would turn 2.3 ms into 2299 us.
      const double period = std::floor(microseconds(number) + 1e-6);
      constexpr double kLongest = 24 * 3600e6;
      if (!(period >= 1 && period <= kLongest)) {
        return refuse(value, "a number that makes a period from 1 us to 24 h");
      }
      endpoint.period_us = static_cast<std::int64_t>(period);
    };
  }

  // ---- Checks of several keys ----

  void check_rate(const Value& value, std::string_view whose) {
    if (!std::holds_alternative<document::Map>(value.content) ||
        document::find(value, "freq_hz") != nullptr ||
        document::find(value, "period_ms") != nullptr) {
      return;
    }
    errors_.add(value.line, fmt::format("{} needs the key 'freq_hz' or 'period_ms'", whose),
                "add one of them");
  }

  void check_topic(const Value& value, const JsonEndpoint& endpoint,
                   const ComponentDescription& node) {
    if (endpoint.topic.empty() || endpoint.type.empty()) return;
    const int line = document::find(value, "msg_type")->line;
    const std::string topic = Node("any", {.name_space = node.name_space}).resolve(endpoint.topic);
    const auto& [type, first_line] =
        topic_types_.try_emplace(topic, endpoint.type, line).first->second;
    if (type == endpoint.type) return;
    errors_.add(line,
                fmt::format("topic '{}' has type {} in line {}, but {} here", topic, type,
                            first_line, endpoint.type),
                "give the topic one type");
  }

  void set_size(const Value& value, JsonEndpoint& publisher) {
    const Value* given = document::find(value, "msg_size");
    const std::int64_t bytes = size_of(publisher.type);
    if (bytes == kVariable && given == nullptr) {
      errors_.add(value.line,
                  fmt::format("a publisher of {} needs the key 'msg_size'", publisher.type),
                  "add it, in bytes");
    } else if (bytes != kVariable && given != nullptr) {
      errors_.add(given->line, fmt::format("{} has a fixed size", publisher.type),
                  "remove 'msg_size', or choose stamped_vector");
    }
    if (bytes != kVariable) publisher.size_bytes = static_cast<int>(bytes);
  }

  std::set<int> executor_ids_;
  std::map<std::string, std::pair<std::string, int>> topic_types_;  // and the line of the first use
  std::size_t values_ = 0;
};

}  // namespace

std::vector<ReferenceSection> describe_workload() {
  document::Errors none("");
  Reading file{none};
  return WorkloadReader(file).describe_file();
}

SystemDescription read_workload(const document::Value& root, document::Errors& errors) {
  Reading file{errors};
  return WorkloadReader(file).read(root);
}

}  // namespace takt
