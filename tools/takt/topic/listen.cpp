// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "graph/dynamic_message.hpp"
#include "graph/type_finder.hpp"
#include "run/result_json.hpp"
#include "topic/topic.hpp"

namespace takt::tools::topic_command {
namespace {

using nlohmann::json;

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

}  // namespace

void echo(const Options& options) {
  Observer observer(options);
  std::optional<OutputFile> file;
  if (!options.json_path.empty() && options.json_path != "-") file.emplace(options.json_path);
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
          const auto fields = read_message(
              *type, bytes,
              {.most = is_cut ? 16 : SIZE_MAX, .bytes_as_text = options.json_path.empty()});
          if (options.json_path == "-") {
            rt::print("{}\n", rt::json_text(fields));
          } else {
            rt::print("{}---\n", to_yaml(fields));
          }
          if (file) file->write(std::string(kTaktsJson) + rt::json_text(fields) + "\n");
        }
        rt::flush_output();
        if (++count == options.count) observer.stop();
      });
  TypeFinder finder(observer);
  if (!options.raw) type = &finder.require(listener.type());
  observer.run(options.duration, /*ends_by_itself=*/options.count != 0);
  if (file) file->complete();
}

namespace {

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
void watch(Observer& observer, const Options& options, Show show,
           Nanoseconds pause = Observer::kPause) {
  json last = json::object();
  const auto timer = observer.node().create_timer("show", std::chrono::seconds(1), [&] {
    last = show(options.json_path != "-");
    rt::flush_output();
  });
  observer.add(timer);
  observer.run(options.duration, /*ends_by_itself=*/false, pause);
  if (!options.json_path.empty()) write_json(last, options.json_path);
}

/// When a message was stamped, by its header, which is its first field.
std::chrono::system_clock::time_point stamp_of(std::span<const std::byte> bytes) {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  if (bytes.size() < kCdrHeader.size() + sizeof sec + sizeof nanosec) return {};
  std::memcpy(&sec, bytes.data() + kCdrHeader.size(), sizeof sec);
  std::memcpy(&nanosec, bytes.data() + kCdrHeader.size() + sizeof sec, sizeof nanosec);
  return std::chrono::system_clock::time_point(std::chrono::seconds(sec) + Nanoseconds(nanosec));
}

}  // namespace

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

void delay(const Options& options) {
  Observer observer(options);
  Window delays(options.window);
  std::uint64_t total = 0, shown = 0;
  const Listener listener(observer, options,
                          [&](std::span<const std::byte> bytes, const MessageInfo&) {
                            const auto now = std::chrono::system_clock::now();
                            delays.add(static_cast<double>((now - stamp_of(bytes)).count()) / 1e6);
                            ++total;
                          });
  const MessageType& type = TypeFinder(observer).require(listener.type());
  if (type.fields.empty() || type.fields.front().shape.type == nullptr ||
      type.fields.front().shape.type->name != "std_msgs/msg/Header") {
    throw Error(fmt::format("the messages of '{}' have no header", listener.topic()),
                "takt topic hz shows their rate");
  }
  bool has_header = false;
  // At once, as the delay ends when a message comes.
  watch(
      observer, options,
      [&](bool prints) {
        if (total == shown) {
          if (prints) rt::to_stderr("no message\n");
          return json{{"topic", listener.topic()}, {"messages", total}};
        }
        shown = total;
        if (prints && !std::exchange(has_header, true)) {
          rt::print("{:>12} {:>12} {:>12} {:>14} {:>8}\n", "delay_ms", "min_ms", "max_ms",
                    "deviation_ms", "window");
        }
        if (prints) {
          rt::print("{:>12.3f} {:>12.3f} {:>12.3f} {:>14.3f} {:>8}\n", delays.mean(), delays.min(),
                    delays.max(), delays.deviation(), delays.size());
        }
        return json{{"topic", listener.topic()}, {"messages", total},
                    {"delay_ms", delays.mean()}, {"min_ms", delays.min()},
                    {"max_ms", delays.max()},    {"deviation_ms", delays.deviation()},
                    {"window", delays.size()}};
      },
      Nanoseconds::zero());
}

}  // namespace takt::tools::topic_command
