// Does loading components disturb running ones?
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "takt/containers/container.hpp"
#include "takt/rt_tests/rt_test.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

constexpr int kCycles = 100;  // loading and unloading, in each round

/// Measurements of the component that runs all the time.
struct Lateness {
  std::mutex mutex;  // taken by the test for a few instructions between rounds
  Histogram histogram;
  std::uint64_t missed = 0;
};
Lateness lateness;

struct Number {
  std::uint64_t number = 0;
};
TAKT_MESSAGE(Number, "rt_tests/msg/Number", number);

class Runner : public Node {
 public:
  explicit Runner(const NodeOptions& options) : Node("runner", options) {
    timer_ = create_timer("timer", 1ms, [this] {
      const Nanoseconds late = Clock::steady().now() - Dispatch::current()->root_release;
      const std::lock_guard lock(lateness.mutex);
      lateness.histogram.record(late);
      lateness.missed = timer_->missed();
    });
  }

 private:
  std::shared_ptr<Timer> timer_;
};

class Guest : public Node {
 public:
  explicit Guest(const NodeOptions& options) : Node("guest", options) {
    publisher_ = create_publisher<Number>("numbers", 10);
    timer_ =
        create_timer("timer", 1ms, [this] { publisher_->publish(std::make_unique<Number>()); });
    subscription_ = create_subscription<Number>("numbers", 10, [](const Number&) {});
  }

 private:
  std::shared_ptr<Publisher<Number>> publisher_;
  std::shared_ptr<Timer> timer_;
  std::shared_ptr<Subscription<Number>> subscription_;
};

struct Row {
  std::string name;
  rt::Rounds rounds;
  std::uint64_t missed = 0;
  std::vector<double> missed_percent;  // of the releases of each round
};

template <class Work>
void run_round(Row& row, Work&& work) {
  std::uint64_t missed_before = 0;
  {
    const std::lock_guard lock(lateness.mutex);
    lateness.histogram = Histogram();
    missed_before = lateness.missed;
  }
  work();
  const std::lock_guard lock(lateness.mutex);
  row.rounds.add(lateness.histogram);
  const std::uint64_t missed = lateness.missed - missed_before;
  row.missed += missed;
  row.missed_percent.push_back(100.0 * static_cast<double>(missed) /
                               static_cast<double>(lateness.histogram.count() + missed));
}

}  // namespace

TAKT_REGISTER_COMPONENT(Runner)
TAKT_REGISTER_COMPONENT(Guest)

int main(int argc, char** argv) {
  rt::RtTest test(argc, argv,
                  fmt::format("How late is a timer of 1 ms under SCHED_FIFO while {} components a "
                              "round are loaded into its container, run, and are unloaded?",
                              kCycles));
  test.needs_realtime();
  SystemDescription system;
  system.file = "loading";
  system.name = "loading";
  system.realtime = Realtime::require;
  system.lock_memory = true;
  system.dds.emplace().domain = 200;
  system.threads = {{.attributes = rt::realtime_thread(80, "fast")}};
  system.executors = {{.name = "fast", .type = "events", .threads = {"fast"}},
                      {.name = "default", .type = "events"}};
  system.components = {{.type = "Runner", .executor = "fast"}};
  Container container(system);
  container.start();
  container.release();
  // The first cycles allocate what remains: pools, thread stacks, tables.
  const auto cycle = [&] {
    const LoadedComponent loaded = container.load({.type = "Guest", .executor = "default"});
    std::this_thread::sleep_for(3ms);
    container.unload(loaded.id);
  };
  for (int i = 0; i < 20; ++i) cycle();
  const std::size_t endpoints = container.endpoints().size();

  Row quiet{.name = "quiet"}, loading{.name = "loading"};
  const int rounds = test.rounds(10);
  for (int round = 0; round < rounds; ++round) {
    run_round(quiet, [] { std::this_thread::sleep_for(500ms); });
    run_round(loading, [&] {
      for (int i = 0; i < kCycles; ++i) cycle();
    });
  }
  const std::size_t endpoints_after = container.endpoints().size();
  container.hold();
  container.stop();
  for (const Row* row : {&quiet, &loading}) {
    auto values = row->rounds.values();
    values.emplace_back("missed", static_cast<double>(row->missed));
    test.add(row->name, values);
  }
  test.expect_at_most(2, loading.rounds.p99_us, quiet.rounds.p99_us,
                      "p99 while loading is at most twice that of quiet");
  // Compare medians: a disturbance by the host affects only some rounds.
  const double before = rt::median(quiet.missed_percent),
               after = rt::median(loading.missed_percent);
  test.expect(after <= 3 * before + 0.5,
              fmt::format("loading misses no more releases (median of the rounds: {:.2f} % against "
                          "{:.2f} %)",
                          after, before));
  test.expect(endpoints_after == endpoints, "no DDS endpoint remains");
  return test.finish();
}
