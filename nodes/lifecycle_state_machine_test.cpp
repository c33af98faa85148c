// Tests of the table of states and transitions, against ROS 2's written out once more.
// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/lifecycle_state_machine.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::lifecycle_state_machine_test {
namespace {

using testing::ElementsAre;

// As `ros2 service call …/get_transition_graph` shows it: id, label, ids of the states.
using Row = std::tuple<int, std::string, int, int>;
const std::vector<Row> kGraph{{1, "configure", 1, 10},
                              {10, "transition_success", 10, 2},
                              {11, "transition_failure", 10, 1},
                              {12, "transition_error", 10, 15},
                              {2, "cleanup", 2, 11},
                              {20, "transition_success", 11, 1},
                              {21, "transition_failure", 11, 2},
                              {22, "transition_error", 11, 15},
                              {3, "activate", 2, 13},
                              {30, "transition_success", 13, 3},
                              {31, "transition_failure", 13, 2},
                              {32, "transition_error", 13, 15},
                              {4, "deactivate", 3, 14},
                              {40, "transition_success", 14, 2},
                              {41, "transition_failure", 14, 3},
                              {42, "transition_error", 14, 15},
                              {5, "shutdown", 1, 12},
                              {6, "shutdown", 2, 12},
                              {7, "shutdown", 3, 12},
                              {50, "transition_success", 12, 4},
                              {51, "transition_failure", 12, 4},
                              {52, "transition_error", 12, 15},
                              {60, "transition_success", 15, 1},
                              {61, "transition_failure", 15, 4},
                              {62, "transition_error", 15, 4}};

Row row(const LifecycleTransition& transition) {
  return {static_cast<int>(transition.id), std::string(transition.label),
          static_cast<int>(transition.start), static_cast<int>(transition.goal)};
}

TEST(LifecycleStateMachine, HasTheTransitionsOfRos2) {
  std::vector<Row> graph;
  for (const auto& transition : lifecycle_transitions()) graph.push_back(row(transition));
  EXPECT_EQ(graph, kGraph);
}

TEST(LifecycleStateMachine, HasTheStatesOfRos2) {
  std::vector<std::pair<int, std::string>> states;
  for (const LifecycleState state : lifecycle_states()) {
    states.emplace_back(static_cast<int>(state), label(state));
    EXPECT_EQ(is_primary(state), static_cast<int>(state) < 10);
  }
  EXPECT_THAT(states, ElementsAre(std::pair(0, "unknown"), std::pair(1, "unconfigured"),
                                  std::pair(2, "inactive"), std::pair(3, "active"),
                                  std::pair(4, "finalized"), std::pair(10, "configuring"),
                                  std::pair(11, "cleaningup"), std::pair(12, "shuttingdown"),
                                  std::pair(13, "activating"), std::pair(14, "deactivating"),
                                  std::pair(15, "errorprocessing")));
}

TEST(LifecycleStateMachine, LeadsFromEachTransitionStateByWhatTheCallbackReturns) {
  for (const auto& [id, label, start, goal] : kGraph) {
    if (start < 10) continue;
    const CallbackReturn result = label == "transition_success"   ? CallbackReturn::SUCCESS
                                  : label == "transition_failure" ? CallbackReturn::FAILURE
                                                                  : CallbackReturn::ERROR;
    EXPECT_EQ(row(find_result(static_cast<LifecycleState>(start), result)),
              Row(id, label, start, goal));
  }
}

TEST(LifecycleStateMachine, FindsInEachStateWhatCanBeAskedForAndNothingElse) {
  for (const LifecycleState from : lifecycle_states()) {
    for (int id = 0; id < 256; ++id) {
      const bool is_possible =
          static_cast<int>(from) < 10 &&
          std::any_of(kGraph.begin(), kGraph.end(), [&](const Row& candidate) {
            return std::get<0>(candidate) == id && std::get<2>(candidate) == static_cast<int>(from);
          });
      EXPECT_EQ(find_transition(from, static_cast<TransitionId>(id)) != nullptr, is_possible)
          << id << " in " << label(from);
    }
    for (const auto& [id, name, start, goal] : kGraph) {
      const bool is_possible =
          static_cast<int>(from) < 10 &&
          std::any_of(kGraph.begin(), kGraph.end(), [&, label = name](const Row& candidate) {
            return std::get<1>(candidate) == label &&
                   std::get<2>(candidate) == static_cast<int>(from);
          });
      EXPECT_EQ(find_transition(from, name) != nullptr, is_possible)
          << name << " in " << label(from);
    }
    EXPECT_EQ(find_transition(from, ""), nullptr);
  }
}

TEST(LifecycleStateMachine, ShutdownIsALabelOfThreeTransitions) {
  using enum LifecycleState;
  EXPECT_EQ(find_transition(unconfigured, "shutdown")->id, TransitionId::unconfigured_shutdown);
  EXPECT_EQ(find_transition(inactive, "shutdown")->id, TransitionId::inactive_shutdown);
  EXPECT_EQ(find_transition(active, "shutdown")->id, TransitionId::active_shutdown);
  EXPECT_EQ(find_transition(finalized, "shutdown"), nullptr);
}

TEST(LifecycleStateMachine, DescribesWhatCanBeAskedFor) {
  using enum LifecycleState;
  EXPECT_EQ(describe_transitions(unconfigured), "'configure' (1), 'shutdown' (5)");
  EXPECT_EQ(describe_transitions(inactive), "'cleanup' (2), 'activate' (3), 'shutdown' (6)");
  EXPECT_EQ(describe_transitions(active), "'deactivate' (4), 'shutdown' (7)");
  EXPECT_EQ(describe_transitions(finalized), "none");
  EXPECT_EQ(describe_transitions(configuring), "none");
}

}  // namespace
}  // namespace takt::lifecycle_state_machine_test
