// SPDX-License-Identifier: Apache-2.0
#include "selftest/stamps.hpp"

#include <fstream>
#include <utility>

#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "takt/base/clock.hpp"
#include "takt/containers/component.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr std::size_t kMostSamples = 1'000'000;
constexpr std::uint64_t kTicksBetweenSamples = 50;

std::int64_t now_ns() noexcept {
  return Clock::steady().now().time_since_epoch().count();
}

}  // namespace

Stamps::Stamps(const NodeOptions& options)
    : Node("stamps", options),
      file_(declare_parameter<std::string>("file", "")),
      work_(std::chrono::microseconds(declare_parameter<std::int64_t>("work_us", 0))) {
  if (options.guest) {
    throw Error("only `takt selftest` uses this component, as it writes a file",
                "load takt::Workload");
  }
  exchange<kSmallBytes>("small", 1ms, small_);
  exchange<kLargeBytes>("large", 20ms, large_);
}

template <std::size_t Bytes>
void Stamps::exchange(const std::string& name, Nanoseconds period, Topic& topic) {
  using Message = Stamped<Bytes>;
  topic.latencies_ns.reserve(kMostSamples);
  const auto publisher = create_publisher<Message>(name, 10, {.loans = 8});
  entities_.push_back(
      create_subscription<Message>(name, 10, [this, &topic](const Message& message) {
        const std::int64_t latency_ns = now_ns() - message.stamp_ns;
        if (topic.latencies_ns.size() < kMostSamples) topic.latencies_ns.push_back(latency_ns);
        if (Bytes == kLargeBytes) burn_cpu(work_);
      }));
  entities_.push_back(create_timer(name + "_timer", period, [this, publisher, &topic] {
    if (Bytes == kSmallBytes && ticks_++ % kTicksBetweenSamples == 0) sample_thread();
    if (auto message = publisher->borrow_loaned_message()) {
      ++topic.sent;
      message->stamp_ns = now_ns();
      publisher->publish(std::move(message));
    }
  }));
}

void Stamps::sample_thread() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  last_ = {now_ns(), thread_cpu_time().count(), usage.ru_nvcsw};
  if (first_.time_ns == 0) first_ = last_;
}

Stamps::~Stamps() {
  if (file_.empty()) return;
  const auto topic_json = [](const Topic& topic) {
    return json{{"sent", topic.sent}, {"latencies_ns", topic.latencies_ns}};
  };
  std::ofstream(file_) << json{
      {"small", topic_json(small_)},
      {"large", topic_json(large_)},
      {"seconds", static_cast<double>(last_.time_ns - first_.time_ns) / 1e9},
      {"cpu_s", static_cast<double>(last_.cpu_ns - first_.cpu_ns) / 1e9},
      {"wakeups", last_.wakeups - first_.wakeups}};
}

}  // namespace takt::tools

TAKT_REGISTER_COMPONENT(takt::tools::Stamps, "what takt selftest compares the statistics with")
