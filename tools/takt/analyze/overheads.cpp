// SPDX-License-Identifier: Apache-2.0
#include "analyze/overheads.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <semaphore>
#include <thread>
#include <vector>

#include "takt/entities/timer.hpp"
#include "takt/executors/executor.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/nodes/node.hpp"
#include "takt/sched/threads/realtime_thread.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using Times = std::vector<Nanoseconds>;
using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kSamples = 1000;
constexpr double kShare = 0.999;
constexpr int kPriority = 80;
/// Subscriptions of one message in the measurement of each.
constexpr std::size_t kReceivers = 4;
/// What callbacks write at most at once in the measurement of memory.
constexpr std::size_t kMegabytes = 4;

Nanoseconds percentile(Times times) {
  std::sort(times.begin(), times.end());
  const auto place = static_cast<std::size_t>(kShare * static_cast<double>(times.size()));
  return times[std::min(place, times.size() - 1)];
}

ThreadAttributes attributes() {
  return {.name = "overheads",
          .policy = ThreadPolicy::fifo,
          .priority = kPriority,
          .affinity = {available_cpus().front()}};
}

/// Sleeps until a message comes, so that who sends it has to wake its thread.
class Receiver {
 public:
  explicit Receiver(std::size_t number)
      : node_(std::make_shared<Node>("receiver" + std::to_string(number))),
        subscription_(node_->create_subscription<std_msgs::msg::String>(
            "/overheads", 10, [](const std_msgs::msg::String&) {})),
        executor_(executors().make(
            "events", {.name = "receiver",
                       .threads = {{.name = "receiver", .affinity = {available_cpus().back()}}}})) {
    executor_->add_node(node_);
    thread_ = std::thread([this] { executor_->spin(); });
  }
  ~Receiver() {
    executor_->cancel();
    thread_.join();
  }

 private:
  const std::shared_ptr<Node> node_;
  const std::shared_ptr<void> subscription_;
  const std::unique_ptr<Executor> executor_;
  std::thread thread_;
};

/// Two timers that are due together: how late the first one is, and how long it takes from the end
/// of its callback to the begin of the other; and how long it takes to publish a small message.
struct Rounds {
  Times wakes, dispatches, publications;

  explicit Rounds(std::size_t receivers) {
    const auto node = std::make_shared<Node>("overheads");
    const auto publisher = node->create_publisher<std_msgs::msg::String>("/overheads", 10);
    std::vector<std::unique_ptr<Receiver>> all;
    while (all.size() < receivers) all.push_back(std::make_unique<Receiver>(all.size()));
    const std::unique_ptr<Executor> executor =
        executors().make("events", {.name = "overheads", .threads = {attributes()}});
    TimePoint end{};
    std::shared_ptr<Timer> first;
    first = node->create_timer("first", 1ms, [&] {
      const TimePoint begin = node->clock().now();
      wakes.push_back(begin - (first->due() - first->period()));
      publisher->publish(std_msgs::msg::String{});
      end = node->clock().now();
      publications.push_back(end - begin);
      if (wakes.size() == kSamples) executor->cancel();
    });
    const auto second = node->create_timer("second", 1ms, [&] {
      if (end == TimePoint{}) return;
      dispatches.push_back(node->clock().now() - end);
      end = TimePoint{};
    });
    executor->add_node(node);
    std::thread([&] { executor->spin(); }).join();
  }
};

/// From one thread to another of the same CPU.
Nanoseconds measure_switch() {
  std::binary_semaphore there{0}, back{0};
  Times times;
  RealtimeThread other(attributes(), Realtime::prefer, [&] {
    for (std::size_t i = 0; i < kSamples; ++i) {
      there.acquire();
      back.release();
    }
  });
  RealtimeThread self(attributes(), Realtime::prefer, [&] {
    for (std::size_t i = 0; i < kSamples; ++i) {
      const auto begin = SteadyClock::now();
      there.release();
      back.acquire();
      times.push_back((SteadyClock::now() - begin) / 2);
    }
  });
  self.join();
  other.join();
  return percentile(std::move(times));
}

/// To write a megabyte of new memory, and to copy it once.
Nanoseconds measure_megabyte() {
  Times times;
  for (int i = 0; i < 20; ++i) {
    const auto begin = SteadyClock::now();
    const std::vector<std::byte> written(kMegabytes * 1'000'000, std::byte{1});
    const std::vector<std::byte> copied = written;
    if (copied.back() != std::byte{1}) std::abort();  // so that it is made
    times.push_back((SteadyClock::now() - begin) / kMegabytes);
  }
  return percentile(std::move(times));
}

}  // namespace

void measure_overheads(MachineDescription& machine, MachineFacts& facts) {
  const Rounds rounds(1), several(kReceivers);
  machine.wake = percentile(rounds.wakes);
  machine.dispatch = percentile(rounds.dispatches);
  machine.publish = percentile(rounds.publications);
  machine.publish_receiver = percentile(several.publications) / kReceivers;
  machine.change = measure_switch();
  machine.publish_megabyte = measure_megabyte();
  facts.overhead_samples = kSamples;
}

}  // namespace takt::tools
