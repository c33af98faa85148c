// Compares workloads in virtual time with theory.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/container.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

/// Runs the file for this time on two virtual CPUs; `threads`: its number of threads.
ProcessResult simulate(const std::string& file, const std::string& executor, std::size_t threads,
                       Nanoseconds duration) {
  ManualClock clock(TimePoint{}, {0, 1});
  SystemDescription system = read_system(std::string(TAKT_WORKLOADS) + "/" + file);
  system.realtime = Realtime::off;
  system.lock_memory = false;
  Container container(system, {.executor = executor, .clock = &clock});
  container.start();
  clock.wait_for_participants(threads);
  container.release();
  clock.advance(duration);
  container.hold();
  clock.advance(1s);
  // Advance the time, so that the run can end.
  std::atomic<bool> has_stopped{false};
  std::thread controller([&] {
    while (!has_stopped.load()) clock.advance(1s);
  });
  container.stop();
  has_stopped.store(true);
  controller.join();
  return container.result();
}

std::map<std::string, ChainStatistics> chains(const ProcessResult& result) {
  std::map<std::string, ChainStatistics> chains;
  for (const auto& chain : result.chains) chains[chain.name] = chain.statistics;
  return chains;
}

TEST(ThreeChains, MissNothingWithTheAssignmentOfTakt) {
  if (available_cpus().size() < 2) GTEST_SKIP() << "the assignment is for two CPUs";
  const auto measured = chains(simulate("three_chains.yaml", "", 3, 10'010ms));
  EXPECT_EQ(measured.at("brake").instances, 500u);
  EXPECT_EQ(measured.at("steer").instances, 200u);
  EXPECT_EQ(measured.at("look").instances, 100u);
  for (const auto& [name, chain] : measured) EXPECT_EQ(chain.misses, 0u) << name;
  EXPECT_EQ(measured.at("brake").latency.max(), 8ms);  // nothing delays it
}

TEST(ThreeChains, MissWithoutIt) {
  const auto measured = chains(simulate("three_chains.yaml", "single_threaded", 1, 10s));
  EXPECT_EQ(measured.at("brake").misses, 96u);
}

// Front and rear lidar meet in the fusion. Its output was once counted only for the lidar whose
// message arrived last, so one of the two chains never got a measurement. By the clock of the test
// every figure is exact: four callbacks of 2 ms, and what one thread does in between.
TEST(ReferenceSystem, MeasuresBothHotPathsThroughTheFusion) {
  const auto measured = chains(simulate("reference_system.yaml", "single_threaded", 1, 2'050ms));
  EXPECT_EQ(measured.at("hot_path_front").instances, 20u);
  EXPECT_EQ(measured.at("hot_path_rear").instances, 20u);
  EXPECT_EQ(measured.at("hot_path_front").latency.min(), 22ms);
  EXPECT_EQ(measured.at("hot_path_front").latency.max(), 30ms);
  EXPECT_EQ(measured.at("hot_path_rear").latency.min(), 22ms);
  EXPECT_EQ(measured.at("hot_path_rear").latency.max(), 30ms);
}

}  // namespace
}  // namespace takt
