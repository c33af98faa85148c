// SPDX-License-Identifier: Apache-2.0
#include "takt/components/workload.hpp"

#include <algorithm>
#include <cctype>
#include <map>

#include <fmt/format.h>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/component.hpp"
#include "takt/messages/message_types.hpp"
#include "takt/nodes/chain_join.hpp"

namespace takt {
namespace {

using Strings = std::vector<std::string>;
using Integers = std::vector<std::int64_t>;

// Limit: a number of a workload, which becomes nanoseconds: 46 days in µs. At it: a larger one is
// refused. Seen: the error.
constexpr std::int64_t kMostOfEntry = 4'000'000'000'000;

/// The list's entry, or the default if the list is not set.
template <class T>
T entry(const std::vector<T>& list, std::size_t index, std::size_t count, const char* name,
        T otherwise) {
  if (list.empty()) return otherwise;
  if (list.size() != count) {
    throw Error(
        fmt::format("parameter '{}' has {} entries for {} topics", name, list.size(), count),
        "give one for each topic, or remove the list");
  }
  if constexpr (std::is_same_v<T, std::int64_t>) {
    if (list[index] < 0 || list[index] > kMostOfEntry) {
      throw Error(fmt::format("parameter '{}' is {}", name, list[index]),
                  fmt::format("write 0 to {}", kMostOfEntry));
    }
  }
  return list[index];
}

std::string choice(std::string value, const char* name, const Strings& valid) {
  if (std::find(valid.begin(), valid.end(), value) == valid.end()) {
    throw Error(fmt::format("'{}' is not a value of '{}'", value, name), suggest(value, valid));
  }
  return value;
}

QoS qos(std::int64_t depth, const std::string& reliability, const std::string& durability) {
  QoS result(static_cast<std::size_t>(std::max<std::int64_t>(depth, 0)));
  if (choice(reliability, "reliability", {"reliable", "best_effort"}) == "best_effort") {
    result.best_effort();
  }
  if (choice(durability, "durability", {"volatile", "transient_local"}) == "transient_local") {
    result.transient_local();
  }
  return result;
}

// Limit: bytes of all messages that a publisher of `takt::Workload` keeps. At it: the component is
// refused. Seen: the error.
constexpr std::size_t kMostBytes = 1'000'000'000;  // of all messages that a publisher keeps

// A negative size is a very large one.
void check_memory(const std::string& topic, std::size_t size_bytes, std::size_t messages) {
  if (size_bytes <= kMostBytes / messages) return;
  throw Error(fmt::format("topic '{}': {} messages of {} bytes are more than {} MB", topic,
                          messages, size_bytes, kMostBytes / 1'000'000),
              "choose a smaller size_bytes, or depth");
}

// Prepares a loaned message.
std::shared_ptr<const WorkloadMessage> prototype(std::type_identity<WorkloadMessage>,
                                                 std::size_t size_bytes) {
  auto result = std::make_shared<WorkloadMessage>();
  result->data.resize(size_bytes);
  return result;
}
template <std::size_t Bytes>
std::shared_ptr<const FixedWorkloadMessage<Bytes>> prototype(
    std::type_identity<FixedWorkloadMessage<Bytes>>, std::size_t) {
  return std::make_shared<FixedWorkloadMessage<Bytes>>();
}

template <std::size_t... Bytes, class Use>
bool use_fixed_type(std::index_sequence<Bytes...>, std::size_t bytes, const Use& use) {
  return ((bytes == Bytes && (use(std::type_identity<FixedWorkloadMessage<Bytes>>{}), true)) ||
          ...);
}

void check_pass_by(std::size_t fixed_bytes, const std::string& pass_by, const char* of) {
  if (fixed_bytes == 0 || pass_by == "loaned_msg" || pass_by == "const_ref") return;
  throw Error(fmt::format("{}.pass_by is '{}' for messages with fixed_bytes", of, pass_by),
              "remove it: they are always loaned, and received by const_ref");
}

/// Calls `use` with the message type of this size.
template <class Use>
void use_type(std::size_t fixed_bytes, const Use& use) {
  if (fixed_bytes == 0) return use(std::type_identity<WorkloadMessage>{});
  using Sizes =
      std::index_sequence<1'000, 50'000, 100'000, 500'000, 1'000'000, 5'000'000, 8'000'000>;
  if (!use_fixed_type(Sizes{}, fixed_bytes, use)) {
    throw Error(fmt::format("there is no workload message of {} bytes", fixed_bytes),
                "use fixed_bytes 1000, 50000, 100000, 500000, 1000000, 5000000 or 8000000");
  }
}

/// Converts a topic to a name within a node.
std::string identifier(std::string topic) {
  std::replace_if(
      topic.begin(), topic.end(),
      [](unsigned char character) { return std::isalnum(character) == 0; }, '_');
  return topic.substr(topic.find_first_not_of('_'));
}

/// Uses this much CPU time; with a manual clock, advances it.
void use_cpu(Clock& clock, Nanoseconds amount) {
  if (amount == Nanoseconds::zero()) return;
  if (ManualClock* manual = clock.as_manual()) {
    manual->work(amount);
  } else {
    burn_cpu(amount);
  }
}

struct Publishing {
  std::string topic, pass_by;
  QoS qos;
  std::chrono::microseconds period, work;
  std::size_t size_bytes, fixed_bytes, fill_bytes;
};

struct Subscribing {
  std::string topic, pass_by;
  QoS qos;
  std::chrono::microseconds work;
  std::size_t fixed_bytes;
};

struct Relaying {
  Strings inputs;
  std::string output;
  QoS qos;
  std::chrono::microseconds work;
  std::size_t size_bytes;
};

/// Creates the entities that a node's parameters describe. It uses the node's own create functions,
/// so a lifecycle node gets managed entities.
template <class AnyNode>
class Maker {
 public:
  explicit Maker(AnyNode& node) : node_(node) {}
  WorkloadEntities make();

 private:
  Strings strings(const char* name) { return node_.template declare_parameter<Strings>(name, {}); }
  Integers integers(const char* name) {
    return node_.template declare_parameter<Integers>(name, {});
  }
  void make_publishers();
  void make_subscriptions();
  void make_relays();
  void make_services();
  template <class T>
  void add_publisher(const Publishing& publishing);
  template <class T>
  void add_subscription(const Subscribing& subscribing);
  void add_relay(const Relaying& relaying);
  void add_client(const std::string& service, std::chrono::microseconds period);
  void add_server(const std::string& service, std::chrono::microseconds work);
  template <class T, class F>
  void subscribe(const Subscribing& subscribing, F callback) {
    entities_.all.push_back(node_.template create_subscription<T>(
        subscribing.topic, subscribing.qos, std::move(callback)));
  }

  /// "TOPIC_timer"; the timer of a second publisher of the same topic is "TOPIC_timer_2".
  std::string timer_name(const std::string& of) {
    const std::string first = identifier(of) + "_timer";
    const int count = ++names_[first];
    return count == 1 ? first : fmt::format("{}_{}", first, count);
  }

  /// As the node names it: the second one of a topic, or of the name of a timer, is "TOPIC#2".
  std::string entity_name(const std::string& topic) {
    const int count = ++names_[topic];
    return count == 1 ? topic : fmt::format("{}#{}", topic, count);
  }

  void works(const std::string& callback, Nanoseconds amount) {
    Nanoseconds& known = entities_.execution_times[callback];
    known = std::max(known, amount);
  }

  /// In one execution; of callbacks of one name, the most.
  void sends(const std::string& callback, std::size_t bytes, std::size_t written = 0) {
    Sending& most = entities_.sent[callback];
    most = {1, std::max(most.bytes, bytes), std::max(most.written, written)};
  }

  AnyNode& node_;
  std::map<std::string, int> names_;
  WorkloadEntities entities_;
};

template <class AnyNode>
WorkloadEntities Maker<AnyNode>::make() {
  make_publishers();
  make_subscriptions();
  make_relays();
  make_services();
  return std::move(entities_);
}

template <class AnyNode>
void Maker<AnyNode>::make_publishers() {
  const Strings out = strings("publishers.topic");
  if (out.empty()) return;
  const Integers periods = integers("publishers.period_us"),
                 sizes = integers("publishers.size_bytes"),
                 fixed = integers("publishers.fixed_bytes"),
                 fills = integers("publishers.fill_bytes"),
                 out_works = integers("publishers.work_us"),
                 out_depths = integers("publishers.depth");
  const Strings out_ways = strings("publishers.pass_by"),
                out_reliabilities = strings("publishers.reliability"),
                out_durabilities = strings("publishers.durability");
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Publishing publishing{
        out[i],
        choice(entry<std::string>(out_ways, i, out.size(), "publishers.pass_by", "loaned_msg"),
               "publishers.pass_by", {"loaned_msg", "unique_ptr", "shared_ptr"}),
        qos(entry<std::int64_t>(out_depths, i, out.size(), "publishers.depth", 10),
            entry<std::string>(out_reliabilities, i, out.size(), "publishers.reliability",
                               "reliable"),
            entry<std::string>(out_durabilities, i, out.size(), "publishers.durability",
                               "volatile")),
        std::chrono::microseconds(
            entry<std::int64_t>(periods, i, out.size(), "publishers.period_us", 0)),
        std::chrono::microseconds(
            entry<std::int64_t>(out_works, i, out.size(), "publishers.work_us", 0)),
        static_cast<std::size_t>(
            entry<std::int64_t>(sizes, i, out.size(), "publishers.size_bytes", 0)),
        static_cast<std::size_t>(
            entry<std::int64_t>(fixed, i, out.size(), "publishers.fixed_bytes", 0)),
        static_cast<std::size_t>(
            entry<std::int64_t>(fills, i, out.size(), "publishers.fill_bytes", 0))};
    check_pass_by(publishing.fixed_bytes, publishing.pass_by, "publishers");
    use_type(publishing.fixed_bytes,
             [&]<class T>(std::type_identity<T>) { add_publisher<T>(publishing); });
  }
}

template <class AnyNode>
void Maker<AnyNode>::make_subscriptions() {
  const Strings in = strings("subscriptions.topic");
  if (in.empty()) return;
  const Integers in_works = integers("subscriptions.work_us"),
                 in_fixed = integers("subscriptions.fixed_bytes"),
                 in_depths = integers("subscriptions.depth");
  const Strings in_ways = strings("subscriptions.pass_by"),
                in_reliabilities = strings("subscriptions.reliability"),
                in_durabilities = strings("subscriptions.durability");
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Subscribing subscribing{
        in[i],
        choice(entry<std::string>(in_ways, i, in.size(), "subscriptions.pass_by", "const_ref"),
               "subscriptions.pass_by", {"const_ref", "shared_ptr", "unique_ptr", "loaned_msg"}),
        qos(entry<std::int64_t>(in_depths, i, in.size(), "subscriptions.depth", 10),
            entry<std::string>(in_reliabilities, i, in.size(), "subscriptions.reliability",
                               "reliable"),
            entry<std::string>(in_durabilities, i, in.size(), "subscriptions.durability",
                               "volatile")),
        std::chrono::microseconds(
            entry<std::int64_t>(in_works, i, in.size(), "subscriptions.work_us", 0)),
        static_cast<std::size_t>(
            entry<std::int64_t>(in_fixed, i, in.size(), "subscriptions.fixed_bytes", 0))};
    check_pass_by(subscribing.fixed_bytes, subscribing.pass_by, "subscriptions");
    use_type(subscribing.fixed_bytes,
             [&]<class T>(std::type_identity<T>) { add_subscription<T>(subscribing); });
  }
}

template <class AnyNode>
void Maker<AnyNode>::make_relays() {
  const Strings from = strings("relays.input");
  if (from.empty()) return;
  const Strings to = strings("relays.output");
  const Integers relay_works = integers("relays.work_us"),
                 relay_sizes = integers("relays.size_bytes"),
                 relay_depths = integers("relays.depth");
  std::vector<Relaying> relays;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const std::string output = entry<std::string>(to, i, from.size(), "relays.output", "");
    const auto found = std::find_if(relays.begin(), relays.end(),
                                    [&](const auto& relay) { return relay.output == output; });
    if (found != relays.end()) {
      found->inputs.push_back(from[i]);
      continue;
    }
    relays.push_back({{from[i]},
                      output,
                      qos(entry<std::int64_t>(relay_depths, i, from.size(), "relays.depth", 1),
                          "reliable", "volatile"),
                      std::chrono::microseconds(
                          entry<std::int64_t>(relay_works, i, from.size(), "relays.work_us", 0)),
                      static_cast<std::size_t>(entry<std::int64_t>(relay_sizes, i, from.size(),
                                                                   "relays.size_bytes", 0))});
  }
  for (const Relaying& relay : relays) add_relay(relay);
}

template <class AnyNode>
void Maker<AnyNode>::make_services() {
  const Strings asked = strings("clients.service"), served = strings("servers.service");
  const Integers ask_periods = asked.empty() ? Integers() : integers("clients.period_us"),
                 serve_works = served.empty() ? Integers() : integers("servers.work_us");
  for (std::size_t i = 0; i < asked.size(); ++i) {
    add_client(asked[i], std::chrono::microseconds(entry<std::int64_t>(ask_periods, i, asked.size(),
                                                                       "clients.period_us", 0)));
  }
  for (std::size_t i = 0; i < served.size(); ++i) {
    add_server(served[i], std::chrono::microseconds(entry<std::int64_t>(
                              serve_works, i, served.size(), "servers.work_us", 0)));
  }
}

template <class AnyNode>
void Maker<AnyNode>::add_client(const std::string& service, std::chrono::microseconds period) {
  const auto client = node_.template create_client<WorkloadService>(service);
  const auto tracking_number = std::make_shared<std::uint64_t>(0);
  entities_.all.push_back(client);
  works(entity_name(service), Nanoseconds::zero());
  const std::string timer = timer_name(service);
  works(timer, Nanoseconds::zero());
  sends(timer, sizeof(WorkloadService::Request));
  entities_.all.push_back(node_.create_timer(timer, period, [client, tracking_number] {
    // A client without responses stops at its maximum number of pending requests.
    if (client->calls_in_flight() == ClientOptions{}.calls_in_flight) return;
    client->async_send_request({.tracking_number = ++*tracking_number},
                               [](const WorkloadService::Response*) {});
  }));
}

template <class AnyNode>
void Maker<AnyNode>::add_server(const std::string& service, std::chrono::microseconds work) {
  const std::string name = entity_name(service);
  works(name, work);
  sends(name, sizeof(WorkloadService::Response));
  entities_.all.push_back(node_.template create_service<WorkloadService>(
      service, [work, &clock = node_.clock()](const WorkloadService::Request& request,
                                              WorkloadService::Response& response) {
        use_cpu(clock, work);
        response.tracking_number = request.tracking_number;
      }));
}

template <class AnyNode>
void Maker<AnyNode>::add_relay(const Relaying& relaying) {
  const std::size_t loans = 2 * relaying.qos.depth + 4;
  check_memory(relaying.output, relaying.size_bytes, loans);
  std::vector<std::string> names;
  for (const std::string& input : relaying.inputs) names.push_back(entity_name(input));
  auto publisher = node_.template create_publisher<WorkloadMessage>(
      relaying.output, relaying.qos,
      {.loans = loans,
       .prototype = prototype(std::type_identity<WorkloadMessage>{}, relaying.size_bytes),
       .published_by = names,
       .joins = relaying.inputs.size() > 1});
  const auto group = node_.create_callback_group("relay_" + identifier(relaying.output),
                                                 CallbackGroupType::MutuallyExclusive);
  const auto has_come = std::make_shared<std::vector<bool>>(relaying.inputs.size());
  const auto join = std::make_shared<ChainJoin>(relaying.inputs.size());
  const auto tracking_number = std::make_shared<std::uint64_t>(0);
  for (std::size_t i = 0; i < relaying.inputs.size(); ++i) {
    works(names[i], relaying.work);
    sends(names[i], relaying.size_bytes);
    entities_.all.push_back(node_.template create_subscription<WorkloadMessage>(
        relaying.inputs[i], relaying.qos,
        [=, &clock = node_.clock(), work = relaying.work](const WorkloadMessage&) {
          (*has_come)[i] = true;
          join->received(i);
          if (std::find(has_come->begin(), has_come->end(), false) != has_come->end()) return;
          has_come->assign(has_come->size(), false);
          use_cpu(clock, work);
          join->combine();
          auto message = publisher->borrow_loaned_message();
          if (message) message->tracking_number = ++*tracking_number;
          publisher->publish(std::move(message));
        },
        group));
  }
  entities_.all.push_back(publisher);
}

template <class AnyNode>
template <class T>
void Maker<AnyNode>::add_publisher(const Publishing& publishing) {
  // Enough messages for the queues of all subscriptions. If all are in use, skip this publication.
  entities_.allocates |= publishing.pass_by != "loaned_msg";
  const std::size_t loans = publishing.pass_by == "loaned_msg" ? 2 * publishing.qos.depth + 4 : 0;
  const std::size_t bytes = std::max(publishing.size_bytes, publishing.fixed_bytes);
  check_memory(publishing.topic, bytes, std::max(loans, publishing.qos.depth));
  const auto fresh = prototype(std::type_identity<T>{}, publishing.size_bytes);
  const std::string timer = timer_name(publishing.topic);
  works(timer, publishing.work);
  sends(timer, bytes, publishing.fill_bytes + (loans == 0 ? bytes : 0));
  auto publisher = node_.template create_publisher<T>(publishing.topic, publishing.qos,
                                                      {.loans = loans,
                                                       .prototype = fresh,
                                                       .expected_period = publishing.period,
                                                       .published_by = {timer}});
  const auto tracking_number = std::make_shared<std::uint64_t>(0);
  const auto fill = [bytes = publishing.fill_bytes](T& message) {
    const auto value = static_cast<std::byte>(message.tracking_number);
    std::fill_n(message.data.begin(), std::min(bytes, message.data.size()), value);
  };
  const auto publish = [&clock = node_.clock(), publisher, tracking_number, publishing, fill,
                        fresh] {
    use_cpu(clock, publishing.work);
    if (publishing.pass_by == "loaned_msg") {
      auto message = publisher->borrow_loaned_message();
      if (message) {
        message->tracking_number = ++*tracking_number;
        fill(*message);
      }
      publisher->publish(std::move(message));
    } else if constexpr (std::same_as<T, WorkloadMessage>) {
      auto message = std::make_unique<T>(*fresh);
      message->tracking_number = ++*tracking_number;
      fill(*message);
      if (publishing.pass_by == "unique_ptr") {
        publisher->publish(std::move(message));
      } else {
        publisher->publish(std::shared_ptr<const T>(std::move(message)));
      }
    }
  };
  entities_.all.push_back(publisher);
  entities_.all.push_back(node_.create_timer(timer, publishing.period, publish));
}

template <class AnyNode>
template <class T>
void Maker<AnyNode>::add_subscription(const Subscribing& subscribing) {
  // Each message is copied, and only its sender knows how long that takes.
  entities_.allocates |= subscribing.pass_by == "unique_ptr";
  const std::string name = entity_name(subscribing.topic);
  if (subscribing.pass_by != "unique_ptr") works(name, subscribing.work);
  const auto work = [&clock = node_.clock(), amount = subscribing.work] { use_cpu(clock, amount); };
  if constexpr (std::same_as<T, WorkloadMessage>) {
    if (subscribing.pass_by == "unique_ptr") {
      return subscribe<T>(subscribing, [work](std::unique_ptr<T>) { work(); });
    }
    if (subscribing.pass_by == "shared_ptr") {
      return subscribe<T>(subscribing, [work](std::shared_ptr<const T>) { work(); });
    }
  }
  subscribe<T>(subscribing, [work](const T&) { work(); });
}

}  // namespace

std::optional<Nanoseconds> WorkloadEntities::execution_time(std::string_view callback) const {
  const auto found = execution_times.find(callback);
  return found != execution_times.end() ? std::optional(found->second) : std::nullopt;
}

std::optional<Sending> WorkloadEntities::sends(std::string_view callback) const {
  const auto found = sent.find(callback);
  return found != sent.end() ? found->second : Sending{};
}

Workload::Workload(const NodeOptions& options)
    : Node("workload", options), entities_(Maker<Node>(*this).make()) {
}

std::optional<Nanoseconds> Workload::execution_time(std::string_view callback) const {
  return entities_.execution_time(callback);
}

LifecycleWorkload::LifecycleWorkload(const NodeOptions& options)
    : LifecycleNode("workload", options), entities_(Maker<LifecycleNode>(*this).make()) {
}

std::optional<Nanoseconds> LifecycleWorkload::execution_time(std::string_view callback) const {
  return entities_.execution_time(callback);
}

}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::Workload,
                        "publishes, receives and uses CPU time as its parameters describe")
TAKT_REGISTER_COMPONENT(takt::LifecycleWorkload, "takt::Workload as a lifecycle node")
TAKT_REGISTER_MESSAGES(takt::WorkloadMessage, takt::WorkloadService::Request,
                       takt::WorkloadService::Response)
