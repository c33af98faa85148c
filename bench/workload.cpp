// SPDX-License-Identifier: Apache-2.0
#include "takt/bench/workload.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "takt/containers/component.hpp"

namespace takt {
namespace {

using Strings = std::vector<std::string>;
using Integers = std::vector<std::int64_t>;

/// The list's entry, or the default where the list was left out.
template <class T>
T entry(const std::vector<T>& list, std::size_t index, std::size_t count, const char* name, T otherwise) {
  if (list.empty()) return otherwise;
  if (list.size() != count) {
    throw Error(fmt::format("parameter '{}' has {} entries for {} topics", name, list.size(), count),
                "give one for each topic, or leave the list out");
  }
  return list[index];
}

std::string choice(std::string value, const char* name, const Strings& valid) {
  if (std::find(valid.begin(), valid.end(), value) == valid.end()) {
    throw Error(fmt::format("'{}' is no value of '{}'", value, name), suggest(value, valid));
  }
  return value;
}

QoS qos(std::int64_t depth, const std::string& reliability) {
  QoS result(static_cast<std::size_t>(std::max<std::int64_t>(depth, 0)));
  return choice(reliability, "reliability", {"reliable", "best_effort"}) == "reliable"
             ? result.reliable()
             : result.best_effort();
}

std::string timer_name(std::string topic) {
  std::replace_if(
      topic.begin(), topic.end(),
      [](unsigned char character) { return std::isalnum(character) == 0; }, '_');
  return topic.substr(topic.find_first_not_of('_')) + "_timer";
}

}  // namespace

struct Workload::Publishing {
  std::string topic, pass_by;
  QoS qos;
  std::chrono::microseconds period, work;
  std::size_t size_bytes;
};

struct Workload::Subscribing {
  std::string topic, pass_by;
  QoS qos;
  std::chrono::microseconds work;
};

Workload::Workload(const NodeOptions& options) : Node("workload", options) {
  const auto strings = [this](const char* name) { return declare_parameter<Strings>(name, {}); };
  const auto integers = [this](const char* name) { return declare_parameter<Integers>(name, {}); };

  const Strings out = strings("publishers.topic");
  const Integers periods = integers("publishers.period_us"), sizes = integers("publishers.size_bytes"),
                 out_works = integers("publishers.work_us"), out_depths = integers("publishers.depth");
  const Strings out_ways = strings("publishers.pass_by"),
                out_reliabilities = strings("publishers.reliability");
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::int64_t period = entry<std::int64_t>(periods, i, out.size(), "publishers.period_us", 0);
    add_publisher(
        {out[i],
         choice(entry<std::string>(out_ways, i, out.size(), "publishers.pass_by", "loaned_msg"),
                "publishers.pass_by", {"loaned_msg", "unique_ptr", "shared_ptr"}),
         qos(entry<std::int64_t>(out_depths, i, out.size(), "publishers.depth", 10),
             entry<std::string>(out_reliabilities, i, out.size(), "publishers.reliability",
                                "reliable")),
         std::chrono::microseconds(period),
         std::chrono::microseconds(
             entry<std::int64_t>(out_works, i, out.size(), "publishers.work_us", 0)),
         static_cast<std::size_t>(
             entry<std::int64_t>(sizes, i, out.size(), "publishers.size_bytes", 0))});
  }

  const Strings in = strings("subscriptions.topic");
  const Integers in_works = integers("subscriptions.work_us"),
                 in_depths = integers("subscriptions.depth");
  const Strings in_ways = strings("subscriptions.pass_by"),
                in_reliabilities = strings("subscriptions.reliability");
  for (std::size_t i = 0; i < in.size(); ++i) {
    add_subscription(
        {in[i],
         choice(entry<std::string>(in_ways, i, in.size(), "subscriptions.pass_by", "const_ref"),
                "subscriptions.pass_by", {"const_ref", "shared_ptr", "unique_ptr", "loaned_msg"}),
         qos(entry<std::int64_t>(in_depths, i, in.size(), "subscriptions.depth", 10),
             entry<std::string>(in_reliabilities, i, in.size(), "subscriptions.reliability",
                                "reliable")),
         std::chrono::microseconds(
             entry<std::int64_t>(in_works, i, in.size(), "subscriptions.work_us", 0))});
  }
}

void Workload::add_publisher(const Publishing& publishing) {
  WorkloadMessage prototype;
  prototype.data.resize(publishing.size_bytes);
  // Enough for the receivers' queues; when all are out, the message is not sent this time.
  const std::size_t loans = publishing.pass_by == "loaned_msg" ? 2 * publishing.qos.depth + 4 : 0;
  auto publisher = create_publisher<WorkloadMessage>(
      publishing.topic, publishing.qos,
      {.loans = loans, .prototype = prototype, .expected_period = publishing.period});
  const auto tracking_number = std::make_shared<std::uint64_t>(0);
  const auto publish = [publisher, tracking_number, publishing] {
    burn_cpu(publishing.work);
    if (publishing.pass_by == "loaned_msg") {
      auto message = publisher->borrow_loaned_message();
      if (message) message->tracking_number = ++*tracking_number;
      publisher->publish(std::move(message));
    } else {
      auto message = std::make_unique<WorkloadMessage>();
      message->data.resize(publishing.size_bytes);
      message->tracking_number = ++*tracking_number;
      if (publishing.pass_by == "unique_ptr") {
        publisher->publish(std::move(message));
      } else {
        publisher->publish(std::shared_ptr<const WorkloadMessage>(std::move(message)));
      }
    }
  };
  entities_.push_back(publisher);
  entities_.push_back(create_timer(timer_name(publishing.topic), publishing.period, publish));
}

void Workload::add_subscription(const Subscribing& subscribing) {
  const auto work = subscribing.work;
  if (subscribing.pass_by == "unique_ptr") {
    entities_.push_back(create_subscription<WorkloadMessage>(
        subscribing.topic, subscribing.qos,
        [work](std::unique_ptr<WorkloadMessage>) { burn_cpu(work); }));
  } else if (subscribing.pass_by == "shared_ptr") {
    entities_.push_back(create_subscription<WorkloadMessage>(
        subscribing.topic, subscribing.qos,
        [work](std::shared_ptr<const WorkloadMessage>) { burn_cpu(work); }));
  } else {
    entities_.push_back(create_subscription<WorkloadMessage>(
        subscribing.topic, subscribing.qos, [work](const WorkloadMessage&) { burn_cpu(work); }));
  }
}

}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::Workload, "publishes, receives and uses the CPU as its parameters say")
