// What does a second worker cost a system that one would serve? A timer of 1 kHz sends a message,
// in one group with the callback that receives it, or in two. One and two workers alternate, and
// the counters are medians of the rounds:
// - chain_us: from the release to the start of the second callback.
// - sleeps: how often a worker went to sleep, for each release.
// - cpu_us: CPU time of the workers, for each release.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "takt/executors/executor.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

struct Tick {
  int number = 0;
};
TAKT_MESSAGE(Tick, "bench/msg/Tick", number);

constexpr int kRounds = 10, kReleases = 200;

struct Result {
  double chain_us = 0, sleeps = 0, cpu_us = 0;
};

Result run(const std::string& type, std::size_t workers, bool has_two_groups) {
  ExecutorOptions options;
  options.statistics = StatisticsLevel::count;
  options.threads.resize(workers);
  const auto executor = executors().make(type, options);
  const auto node = std::make_shared<Node>("node");
  const auto group = node->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
  const auto publisher = node->create_publisher<Tick>("ticks", 1);
  std::vector<double> chain_us;
  const auto timer = node->create_timer("timer", 1ms, [&] { publisher->publish(Tick{}); });
  const auto subscription = node->create_subscription<Tick>(
      "ticks", 1,
      [&](const Tick&) {
        const TimePoint now = Clock::steady().now();
        chain_us.push_back(static_cast<double>((now - Dispatch::current()->root_release).count()) /
                           1e3);
        if (chain_us.size() == kReleases) executor->cancel();
      },
      has_two_groups ? group : nullptr);
  executor->add_node(node);
  executor->spin();
  Result result{.chain_us = rt::median(chain_us)};
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    result.sleeps += static_cast<double>(thread.counters.voluntary_switches) / kReleases;
    result.cpu_us += static_cast<double>(thread.cpu_time.count()) / 1e3 / kReleases;
  }
  return result;
}

void timer(benchmark::State& state, const std::string& type, bool has_two_groups) {
  struct {
    std::vector<double> chain_us, sleeps, cpu_us;
  } of[2];
  for ([[maybe_unused]] auto _ : state) {
    for (const std::size_t workers : {1u, 2u}) {
      const Result result = run(type, workers, has_two_groups);
      of[workers - 1].chain_us.push_back(result.chain_us);
      of[workers - 1].sleeps.push_back(result.sleeps);
      of[workers - 1].cpu_us.push_back(result.cpu_us);
    }
  }
  for (const int workers : {1, 2}) {
    const std::string suffix = "_" + std::to_string(workers);
    state.counters["chain_us" + suffix] = rt::median(of[workers - 1].chain_us);
    state.counters["sleeps" + suffix] = rt::median(of[workers - 1].sleeps);
    state.counters["cpu_us" + suffix] = rt::median(of[workers - 1].cpu_us);
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const std::string type : {"events", "multi_threaded"}) {
    for (const bool has_two_groups : {false, true}) {
      const std::string name = type + (has_two_groups ? "/two_groups" : "/one_group");
      benchmark::RegisterBenchmark(name.c_str(), timer, type, has_two_groups)
          ->Iterations(kRounds)
          ->UseRealTime();
    }
  }
  return true;
}();

}  // namespace
}  // namespace takt
