// An executor with nothing to do does nothing: no polling, no helper thread, no periodic wake-up.
// Others: 50 % of a CPU when idle (rclcpp #2799), a wake-up each 50 ms or 100 ms (Agnocast, CIE).
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <gtest/gtest.h>

#include "takt/executors/executor.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

TEST(Idle, ExecutorThreadsSleepThroughFiveSeconds) {
  struct Idler {
    std::string name;
    std::unique_ptr<Executor> executor;
    std::shared_ptr<Node> node;
    std::shared_ptr<Timer> timer;
    std::thread thread;
  };
  std::vector<Idler> idlers;
  for (const std::string& name : executors().names()) {
    Idler idler{
        name, executors().make(name, {.name = name}), std::make_shared<Node>("node"), {}, {}};
    idler.timer = idler.node->create_timer("hourly", 1h, [] {});
    idler.executor->add_node(idler.node);
    idlers.push_back(std::move(idler));
  }
  for (Idler& idler : idlers) idler.thread = std::thread([&] { idler.executor->spin(); });
  std::this_thread::sleep_for(5s);
  for (Idler& idler : idlers) {
    idler.executor->cancel();
    idler.thread.join();
    for (const ThreadStatistics& thread : idler.executor->thread_statistics()) {
      // It went to sleep once, and was woken by cancel.
      EXPECT_LE(thread.counters.voluntary_switches, 1u) << idler.name << " " << thread.asked.name;
    }
  }
}

}  // namespace
}  // namespace takt
