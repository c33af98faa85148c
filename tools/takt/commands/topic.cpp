// takt topic: shows the topics on the domain, receives from them and publishes to them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <set>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "graph/dynamic_message.hpp"
#include "graph/observer.hpp"
#include "graph/type_finder.hpp"
#include "json_text.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::topic_command {
namespace {

using nlohmann::json;

struct Options : ObserverOptions {
  std::string topic, type, message = "{}";
  double duration_s = 0, rate_hz = 0;
  std::uint64_t count = 0;
  std::size_t window = 1000;
  bool full = false, raw = false;

  Nanoseconds duration() const { return Nanoseconds(static_cast<std::int64_t>(duration_s * 1e9)); }
};

std::string text_of(const QoS& qos) {
  std::string text = qos.reliability == Reliability::reliable ? "reliable" : "best effort";
  text += qos.durability == Durability::transient_local ? ", transient local" : ", volatile";
  const auto add = [&](const char* name, Nanoseconds duration) {
    if (duration != Nanoseconds::zero()) text += fmt::format(", {} {}", name, to_string(duration));
  };
  add("deadline", qos.deadline_period);
  add("lifespan", qos.lifespan_duration);
  add("lease", qos.lease_duration);
  return text;
}

// ---- list, info ----

/// When there is an end of a topic for which `is_meant`.
template <class IsMeant>
Graph graph_with(const Options& options, IsMeant is_meant) {
  return Observer(options).whole_graph([&](const Graph& seen) {
    const auto has = [&](const std::vector<GraphEndpoint>& ends) {
      return std::any_of(ends.begin(), ends.end(),
                         [&](const GraphEndpoint& end) { return is_meant(end.name); });
    };
    return has(seen.publishers) || has(seen.subscriptions);
  });
}

void list(const Options& options) {
  const auto is_shown = [&](const std::string& topic) { return options.all || !is_hidden(topic); };
  const Graph graph = graph_with(options, is_shown);
  struct Row {
    std::set<std::string> types;
    std::size_t publishers = 0, subscriptions = 0;
  };
  std::map<std::string, Row> topics;
  for (const GraphEndpoint& publisher : graph.publishers) {
    Row& row = topics[publisher.name];
    row.types.insert(publisher.type);
    ++row.publishers;
  }
  for (const GraphEndpoint& subscription : graph.subscriptions) {
    Row& row = topics[subscription.name];
    row.types.insert(subscription.type);
    ++row.subscriptions;
  }
  Table table({"topic", "type", "publishers", "subscriptions"});
  json rows = json::array();
  for (const auto& [name, row] : topics) {
    if (!is_shown(name)) continue;
    table.add({name, fmt::format("{}", fmt::join(row.types, ", ")), std::to_string(row.publishers),
               std::to_string(row.subscriptions)});
    rows.push_back({{"topic", name},
                    {"types", row.types},
                    {"publishers", row.publishers},
                    {"subscriptions", row.subscriptions}});
  }
  if (rows.empty()) rt::to_stderr("no topic on DDS domain {}\n", options.domain.number());
  if (options.json_path != "-") table.print("topics");
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

void info(const Options& options) {
  const std::string topic = absolute(options.topic);
  const Graph graph = graph_with(options, [&](const std::string& name) { return name == topic; });
  Table table({"end", "node", "type", "QoS"});
  json rows = json::array();
  const auto add = [&](const char* end, const std::vector<GraphEndpoint>& endpoints) {
    for (const GraphEndpoint& endpoint : endpoints) {
      if (endpoint.name != topic) continue;
      table.add(
          {end, endpoint.node.empty() ? "?" : endpoint.node, endpoint.type, text_of(endpoint.qos)});
      rows.push_back({{"end", end},
                      {"node", endpoint.node},
                      {"type", endpoint.type},
                      {"type_hash", endpoint.type_hash},
                      {"qos", text_of(endpoint.qos)}});
    }
  };
  add("publisher", graph.publishers);
  add("subscription", graph.subscriptions);
  if (rows.empty()) type_of(graph.publishers, graph.subscriptions, topic, "topic");  // throws
  if (options.json_path != "-") table.print(topic);
  if (!options.json_path.empty()) write_json(rows, options.json_path);
}

// ---- echo, hz, bw ----

/// A subscription whose QoS matches all publishers.
class Listener {
 public:
  Listener(Observer& observer, const Options& options, SerializedCallback callback)
      : topic_(absolute(options.topic)) {
    const Graph graph = observer.graph([&](const Graph& seen) {
      return std::any_of(seen.publishers.begin(), seen.publishers.end(),
                         [&](const auto& publisher) { return publisher.name == topic_; });
    });
    type_ = options.type.empty() ? type_of(graph.publishers, graph.subscriptions, topic_, "topic")
                                 : options.type;
    // Best effort, so that a publisher never waits for this observer. But only a reliable
    // subscription gets the messages kept for late ones (transient local).
    bool is_kept = true, is_offered = false;
    for (const GraphEndpoint& publisher : graph.publishers) {
      if (publisher.name != topic_) continue;
      is_offered = true;
      is_kept = is_kept && publisher.qos.durability == Durability::transient_local &&
                publisher.qos.reliability == Reliability::reliable;
    }
    if (!is_offered) rt::to_stderr("'{}' has no publisher yet\n", topic_);
    QoS qos(10'000);
    is_offered&& is_kept ? qos.transient_local() : qos.best_effort();
    subscription_ =
        observer.node().create_generic_subscription(topic_, type_, qos, std::move(callback));
    observer.add(subscription_);
  }
  const std::string& topic() const noexcept { return topic_; }
  const std::string& type() const noexcept { return type_; }

 private:
  const std::string topic_;
  std::string type_;
  std::shared_ptr<SubscriptionBase> subscription_;
};

void echo(const Options& options) {
  Observer observer(options);
  std::ofstream file;
  if (!options.json_path.empty() && options.json_path != "-") {
    check_writable(options.json_path);
    file.open(options.json_path);
  }
  const MessageType* type = nullptr;
  std::uint64_t count = 0;
  const Listener listener(
      observer, options, [&](std::span<const std::byte> bytes, const MessageInfo&) {
        if (options.count != 0 && count == options.count) return;
        if (options.raw) {
          for (const std::byte byte : bytes) rt::print("{:02x}", std::to_integer<int>(byte));
          rt::print("\n");
        } else {
          const bool is_cut = options.json_path.empty() && !options.full;
          const auto fields = read_message(*type, bytes, {.most = is_cut ? 16 : SIZE_MAX});
          if (options.json_path == "-") {
            rt::print("{}\n", json_text(fields));
          } else {
            rt::print("{}---\n", to_yaml(fields));
          }
          if (file.is_open() && !(file << json_text(fields) << '\n')) {
            throw not_written("messages", options.json_path);
          }
        }
        rt::flush_output();
        if (++count == options.count) observer.stop();
      });
  TypeFinder finder(observer);
  if (!options.raw) type = &finder.require(listener.type());
  observer.run(options.duration());
  if (file.is_open() && !file.flush()) throw not_written("messages", options.json_path);
}

/// Statistics of the last messages.
class Window {
 public:
  explicit Window(std::size_t size) : size_(size) {}
  void add(double value) {
    if (values_.size() < size_) {
      values_.push_back(value);
    } else {
      values_[next_++ % size_] = value;
    }
  }
  bool empty() const { return values_.empty(); }
  std::size_t size() const { return values_.size(); }
  double mean() const {
    double sum = 0;
    for (const double value : values_) sum += value;
    return sum / static_cast<double>(values_.size());
  }
  double deviation() const {
    const double middle = mean();
    double sum = 0;
    for (const double value : values_) sum += (value - middle) * (value - middle);
    return std::sqrt(sum / static_cast<double>(values_.size()));
  }
  double min() const { return *std::min_element(values_.begin(), values_.end()); }
  double max() const { return *std::max_element(values_.begin(), values_.end()); }

 private:
  const std::size_t size_;
  std::vector<double> values_;
  std::size_t next_ = 0;
};

/// Calls `show` every second, and writes the last row as JSON.
template <class Show>
void watch(Observer& observer, const Options& options, Show show) {
  json last = json::object();
  const auto timer = observer.node().create_timer("show", std::chrono::seconds(1), [&] {
    last = show(options.json_path != "-");
    rt::flush_output();
  });
  observer.add(timer);
  observer.run(options.duration());
  if (!options.json_path.empty()) write_json(last, options.json_path);
}

void hz(const Options& options) {
  Observer observer(options);
  Window periods(options.window);
  TimePoint before{};
  std::uint64_t total = 0, shown = 0;
  const auto note = [&](std::span<const std::byte>, const MessageInfo& info) {
    const TimePoint sent = info.publish_time;
    if (total++ != 0) periods.add(static_cast<double>((sent - before).count()) / 1e6);
    before = sent;
  };
  const Listener listener(observer, options, note);
  bool has_header = false;
  watch(observer, options, [&](bool prints) {
    if (periods.empty() || total == shown) {
      if (prints) rt::to_stderr("no message\n");
      return json{{"topic", listener.topic()}, {"messages", total}, {"rate_hz", 0}};
    }
    shown = total;
    const json row{{"topic", listener.topic()},       {"messages", total},
                   {"rate_hz", 1e3 / periods.mean()}, {"period_min_ms", periods.min()},
                   {"period_max_ms", periods.max()},  {"period_deviation_ms", periods.deviation()},
                   {"window", periods.size()}};
    if (prints && !std::exchange(has_header, true)) {
      rt::print("{:>12} {:>12} {:>12} {:>14} {:>8}\n", "rate_hz", "min_ms", "max_ms",
                "deviation_ms", "window");
    }
    if (prints) {
      rt::print("{:>12.3f} {:>12.3f} {:>12.3f} {:>14.3f} {:>8}\n", 1e3 / periods.mean(),
                periods.min(), periods.max(), periods.deviation(), periods.size());
    }
    return row;
  });
}

void bw(const Options& options) {
  Observer observer(options);
  Window sizes(options.window);
  std::uint64_t bytes_of_second = 0, total = 0;
  const Listener listener(observer, options,
                          [&](std::span<const std::byte> bytes, const MessageInfo&) {
                            sizes.add(static_cast<double>(bytes.size()));
                            bytes_of_second += bytes.size();
                            ++total;
                          });
  bool has_header = false;
  watch(observer, options, [&](bool prints) {
    const std::uint64_t rate = std::exchange(bytes_of_second, 0);
    if (sizes.empty()) {
      if (prints) rt::to_stderr("no message\n");
      return json{{"topic", listener.topic()}, {"messages", total}, {"bytes_per_s", 0}};
    }
    if (prints && !std::exchange(has_header, true)) {
      rt::print("{:>14} {:>12} {:>12} {:>12} {:>8}\n", "bytes_per_s", "mean_bytes", "min_bytes",
                "max_bytes", "window");
    }
    if (prints) {
      rt::print("{:>14} {:>12.0f} {:>12.0f} {:>12.0f} {:>8}\n", rate, sizes.mean(), sizes.min(),
                sizes.max(), sizes.size());
    }
    return json{{"topic", listener.topic()}, {"messages", total},
                {"bytes_per_s", rate},       {"mean_bytes", sizes.mean()},
                {"min_bytes", sizes.min()},  {"max_bytes", sizes.max()},
                {"window", sizes.size()}};
  });
}

// ---- pub ----

void pub(const Options& options) {
  Observer observer(options);
  const ByteBuffer message =
      write_message(TypeFinder(observer).require(options.type), options.message);
  const auto publisher =
      observer.node().create_generic_publisher(absolute(options.topic), options.type, QoS(10));
  const TimePoint end = later(Clock::steady().now(), std::chrono::seconds(3));
  while (publisher->subscription_count() == 0) {
    if (Clock::steady().now() > end) {
      if (options.rate_hz != 0) break;  // a subscription may appear later
      throw Error(fmt::format("'{}' has no subscription", publisher->topic()),
                  "check the name with takt topic list, or publish repeatedly with --rate");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  publisher->publish(message.bytes());
  std::uint64_t count = 1;
  const std::uint64_t most = options.rate_hz == 0 ? 1 : options.count;
  if (count != most) {
    const auto timer = observer.node().create_timer(
        "send", Nanoseconds(static_cast<std::int64_t>(1e9 / options.rate_hz)), [&] {
          publisher->publish(message.bytes());
          if (++count == most) observer.stop();
        });
    observer.add(timer);
    observer.run(options.duration());
  }
  std::this_thread::sleep_for(
      std::chrono::milliseconds(100));  // so that messages in transit arrive
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what, void (*function)(const Options&),
                       bool has_topic = true, bool has_json = true) {
    CLI::App* sub = command->add_subcommand(name, what);
    if (has_topic) sub->add_option("TOPIC", options->topic, "Its name")->required();
    add_observer_options(*sub, *options, has_json);
    sub->callback([options, function] { function(*options); });
    return sub;
  };
  const auto add_listening = [&](CLI::App* sub) {
    sub->add_option("--duration", options->duration_s, "Seconds (default: until Ctrl-C)")
        ->check(CLI::PositiveNumber);
    sub->add_option("--type", options->type, "The type, if discovery reports several or none");
    return sub;
  };
  add("list", "Lists all topics", list, false)
      ->add_flag("-a,--all", options->all, "Include hidden topics, whose names begin with '_'");
  add("info", "Shows publishers and subscriptions, with their QoS", info);
  for (const auto& [name, what, function] :
       {std::tuple("hz", "Prints the message rate every second", &hz),
        std::tuple("bw", "Prints the bandwidth every second", &bw)}) {
    add_listening(add(name, what, function))
        ->add_option("--window", options->window, "Number of last messages that are evaluated")
        ->check(CLI::PositiveNumber);
  }
  CLI::App* echo_command = add_listening(add("echo", "Prints each message", echo));
  add_library_option(*echo_command, options->libraries);
  echo_command->add_option("-n,--count", options->count, "Stop after this many messages");
  echo_command->add_flag("--full", options->full, "Print all elements of long arrays");
  echo_command->add_flag("--raw", options->raw, "Print bytes, for types that nobody knows");
  CLI::App* pub_command = add("pub", "Publishes a message, once or repeatedly", pub, true, false);
  add_library_option(*pub_command, options->libraries);
  pub_command->add_option("TYPE", options->type, "The type, for example std_msgs/msg/String")
      ->required();
  pub_command->add_option("MESSAGE", options->message,
                          "The message as YAML; missing fields are zero");
  pub_command
      ->add_option("-r,--rate", options->rate_hz, "Messages per second (default: only one message)")
      ->check(CLI::PositiveNumber);
  pub_command->add_option("-n,--count", options->count,
                          "With --rate: stop after this many messages");
  pub_command
      ->add_option("--duration", options->duration_s, "With --rate: stop after this many seconds")
      ->check(CLI::PositiveNumber);
  command->footer(
      "Example:\n"
      "  takt topic list\n"
      "  takt topic hz /scan\n"
      "  takt topic echo /odom -n 1\n"
      "  takt topic echo /weather --library libweather.so\n"
      "  takt topic pub /cmd_vel geometry_msgs/msg/Twist '{linear: {x: 0.2}}' --rate 10\n");
}
const Command registered("topic", "Shows and uses topics on a DDS domain, including ROS 2's",
                         set_up);

}  // namespace
}  // namespace takt::tools::topic_command
