// One of two processes that exchange messages over UDP, for wire.py, which runs it beside ddsperf.
// usage: wire_pair ping|pong|pub|sub BYTES [KEY=VALUE...]
// `pong` returns what `ping` sends; `pub` sends as fast as nothing is lost, as `sub` tells it how
// far it is. `ping` and `sub` print a line of JSON after SECONDS; the others run until they are
// killed. Keys: seconds; dds_cpu, executor_cpu: where the threads run, by default on all CPUs of
// the process; dds_priority, executor_priority: SCHED_FIFO; spin: `50us` or `always`.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "takt/base/histogram.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

// As that of ddsperf: two numbers of 32 bits, and bytes with their number.
struct Parcel {
  std::uint32_t number = 0, key = 0;
  std::vector<std::uint8_t> bytes;
};
TAKT_MESSAGE(Parcel, "bench/msg/WireParcel", number, key, bytes);
constexpr std::size_t kFixedBytes = 12;

constexpr std::uint32_t kWindow = 500;  // how many messages of `pub` are on their way at most
constexpr std::uint32_t kStep = 50;     // after how many `sub` says so

using Keys = std::map<std::string, std::string>;

ThreadAttributes attributes(const Keys& keys, const std::string& prefix) {
  ThreadAttributes result;
  if (const auto cpu = keys.find(prefix + "_cpu"); cpu != keys.end()) {
    result.affinity = {std::stoi(cpu->second)};
  }
  if (const auto priority = keys.find(prefix + "_priority"); priority != keys.end()) {
    result.policy = ThreadPolicy::fifo;
    result.priority = std::stoi(priority->second);
  }
  return result;
}

/// A node with a topic that it hears and one that it says, and an executor of one thread.
class Side {
 public:
  using Receive = std::function<void(const Parcel&)>;
  Side(const Keys& keys, std::size_t bytes, const std::string& hears, const std::string& says,
       std::size_t depth, Receive receive) {
    ExecutorOptions options;
    options.threads = {attributes(keys, "executor")};
    if (const auto spin = keys.find("spin"); spin != keys.end()) {
      options.spin = spin->second == "always" ? kSpinAlways : parse_duration(spin->second);
    }
    executor = executors().make("events", options);
    NodeOptions node_options;
    node_options.participant = Participant::create(
        {.threads = attributes(keys, "dds"), .shared_memory = SharedMemory::off});
    node_ = std::make_shared<Node>("side", node_options);
    const auto prototype = std::make_shared<Parcel>();
    prototype->bytes.resize(bytes - kFixedBytes);
    publisher_ = node_->create_publisher<Parcel>(says, depth, {.loans = 4, .prototype = prototype});
    subscription_ = node_->create_subscription<Parcel>(
        hears, depth, [receive = std::move(receive)](const Parcel& parcel) { receive(parcel); });
    executor->add_node(node_);
  }
  void say(std::uint32_t number) {
    auto parcel = publisher_->borrow_loaned_message();
    parcel->number = number;
    publisher_->publish(std::move(parcel));
  }

  std::unique_ptr<Executor> executor;

 private:
  std::shared_ptr<Node> node_;
  std::shared_ptr<Publisher<Parcel>> publisher_;
  std::shared_ptr<Subscription<Parcel>> subscription_;
};

TimePoint now() {
  return Clock::steady().now();
}

void pong(const Keys& keys, std::size_t bytes) {
  Side* self = nullptr;
  Side side(keys, bytes, "/ping", "/pong", 1,
            [&self](const Parcel& parcel) { self->say(parcel.number); });
  self = &side;
  side.executor->spin();
}

void ping(const Keys& keys, std::size_t bytes, Nanoseconds duration) {
  Side* self = nullptr;
  Histogram trips;
  std::atomic<bool> is_known = false;
  TimePoint sent, end;
  Side side(keys, bytes, "/pong", "/ping", 1, [&](const Parcel& parcel) {
    if (parcel.number == 0) return is_known.store(true);  // 0: from before the game
    const TimePoint received = now();
    trips.record(received - sent);
    if (received >= end) return self->executor->cancel();
    sent = received;
    self->say(parcel.number + 1);
  });
  self = &side;
  std::thread spin([&] { side.executor->spin(); });
  for (; !is_known; std::this_thread::sleep_for(10ms)) side.say(0);  // until each hears the other
  std::this_thread::sleep_for(100ms);  // what was said to nobody is not on its way any more
  sent = now();
  end = sent + duration;
  side.say(1);
  spin.join();
  fmt::print("{{\"p50_us\": {}, \"p99_us\": {}, \"per_s\": {}}}\n", rt::us(trips.percentile(0.5)),
             rt::us(trips.percentile(0.99)),
             static_cast<double>(trips.count()) / std::chrono::duration<double>(duration).count());
}

void pub(const Keys& keys, std::size_t bytes) {
  std::atomic<std::uint32_t> received = 0;
  Side side(keys, bytes, "/far", "/data", kWindow, [&](const Parcel& parcel) {
    received.store(parcel.number);
    received.notify_one();
  });
  std::thread spin([&] { side.executor->spin(); });
  for (; received == 0; std::this_thread::sleep_for(10ms)) side.say(0);
  for (std::uint32_t number = kStep + 1;; ++number) {
    for (std::uint32_t seen; number - (seen = received.load()) > kWindow;) received.wait(seen);
    side.say(number);
  }
}

void sub(const Keys& keys, std::size_t bytes, Nanoseconds duration) {
  Side* self = nullptr;
  std::atomic<std::uint64_t> count = 0;
  std::uint64_t lost = 0;
  std::uint32_t last = kStep;
  Side side(keys, bytes, "/data", "/far", kWindow, [&](const Parcel& parcel) {
    if (parcel.number == 0) return self->say(kStep);
    count.fetch_add(1, std::memory_order_relaxed);
    lost += parcel.number - last - 1;
    last = parcel.number;
    if (last % kStep == 0) self->say(last);
  });
  self = &side;
  std::thread spin([&] { side.executor->spin(); });
  while (count == 0) std::this_thread::sleep_for(1ms);
  const std::uint64_t before = count;
  const TimePoint begin = now();
  std::this_thread::sleep_for(duration);
  const auto received = static_cast<double>(count - before);
  const double per_s = received / std::chrono::duration<double>(now() - begin).count();
  side.executor->cancel();
  spin.join();
  fmt::print("{{\"per_s\": {}, \"lost\": {}}}\n", per_s, lost);
}

int run(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: wire_pair ping|pong|pub|sub BYTES [KEY=VALUE...]\n";
    return 2;
  }
  const std::string role = argv[1];
  const std::size_t bytes = std::max(std::stoul(argv[2]), kFixedBytes);
  Keys keys;
  for (int i = 3; i < argc; ++i) {
    const std::string word = argv[i];
    keys[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
  }
  const Nanoseconds duration = keys.contains("seconds")
                                   ? Nanoseconds(std::stol(keys.at("seconds")) * 1'000'000'000)
                                   : Nanoseconds(1s);
  if (role == "ping") ping(keys, bytes, duration);
  if (role == "pong") pong(keys, bytes);
  if (role == "pub") pub(keys, bytes);
  if (role == "sub") sub(keys, bytes, duration);
  return 0;
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  return takt::run(argc, argv);
}
