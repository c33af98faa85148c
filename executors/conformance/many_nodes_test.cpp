// Systems of thousands of nodes: the work grows as they do.
// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

/// The CPU time of this thread that so many nodes take to be added, to begin their timers anew, as
/// a container does before they run, and to go: half of them as nodes, half entity by entity.
Nanoseconds time_of(std::size_t count) {
  std::vector<std::shared_ptr<Node>> nodes;
  std::vector<std::shared_ptr<void>> handles;
  std::vector<std::shared_ptr<Timer>> timers;
  for (std::size_t i = 0; i < count; ++i) {
    nodes.push_back(std::make_shared<Node>("node_" + std::to_string(i)));
    for (const char* name : {"a", "b", "c"}) {
      handles.push_back(nodes.back()->create_guard_condition(name, [] {}));
    }
    timers.push_back(nodes.back()->create_timer("timer", 1h, [] {}));
  }
  const Nanoseconds begin = thread_cpu_time();
  const auto executor = executors().make("events", {});
  for (const auto& node : nodes) executor->add_node(node);
  executor->spin_some();
  for (const auto& timer : timers) timer->begin_phase();
  executor->spin_some();
  for (std::size_t i = 0; i < count / 2; ++i) executor->remove_node(nodes[i]);
  handles.clear();
  timers.clear();
  return thread_cpu_time() - begin;
}

// A look at all others for each timer that begins anew, or each callback that goes, would be 16
// times the work. In one of three rounds others leave the machine's caches alone.
TEST(Nodes, FourTimesAsManyTakeAboutFourTimesAsLong) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the thread sanitizer's own work grows faster";  // 9 times, and 5 without it
#endif
  time_of(100);
  std::string rounds;
  for (int round = 0; round < 3; ++round) {
    const Nanoseconds few = time_of(2000);
    const Nanoseconds many = time_of(8000);
    if (many < 8 * few) return;
    rounds += std::to_string(few.count()) + " and " + std::to_string(many.count()) + " ns; ";
  }
  FAIL() << rounds;
}

}  // namespace
}  // namespace takt::conformance
