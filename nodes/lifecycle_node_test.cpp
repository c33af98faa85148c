// Tests of nodes with a lifecycle: every transition.
// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/lifecycle_node_test.hpp"

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using enum LifecycleState;

// ---- Transitions ----

struct Row {
  std::string label;
  int id;
  LifecycleState start, via, success, failure;
};
const std::vector<Row> kTable{{"configure", 1, unconfigured, configuring, inactive, unconfigured},
                              {"cleanup", 2, inactive, cleaningup, unconfigured, inactive},
                              {"activate", 3, inactive, activating, active, inactive},
                              {"deactivate", 4, active, deactivating, inactive, active},
                              {"shutdown", 5, unconfigured, shuttingdown, finalized, finalized},
                              {"shutdown", 6, inactive, shuttingdown, finalized, finalized},
                              {"shutdown", 7, active, shuttingdown, finalized, finalized}};

const std::map<std::string, TestNode::Action> kActions{
    {"success", [] { return CallbackReturn::SUCCESS; }},
    {"failure", [] { return CallbackReturn::FAILURE; }},
    {"error", [] { return CallbackReturn::ERROR; }},
    {"a number that is not a result", [] { return static_cast<CallbackReturn>(0); }},
    {"exception", []() -> CallbackReturn { throw std::runtime_error("no such device"); }},
    {"exception of another type", []() -> CallbackReturn { throw 1; }}};

TEST(LifecycleNode, IsBroughtDownFromEveryStateWhateverItsCallbacksReturn) {
  for (const LifecycleState state : {unconfigured, inactive, active, finalized}) {
    for (const auto& [outcome, action] : kActions) {
      for (const LifecycleState fails : {deactivating, cleaningup, shuttingdown}) {
        const auto node = std::make_shared<TestNode>();
        node->go_to(state);
        node->actions[fails] = action;
        node->bring_down();
        EXPECT_EQ(node->get_current_state(), finalized)
            << label(state) << ", " << label(fails) << ": " << outcome;
      }
    }
  }
}

TEST(LifecycleNode, GoesThroughEveryRowOfTheTableWithEveryOutcome) {
  for (const Row& row : kTable) {
    for (const auto& [outcome, action] : kActions) {
      for (const auto& [error_outcome, error_action] : kActions) {
        for (const bool by_label : {true, false}) {
          const bool is_error = outcome != "success" && outcome != "failure";
          if (!is_error && error_outcome != "success") continue;  // on_error is not called
          SCOPED_TRACE(row.label + " from " + std::string(label(row.start)) + ": " + outcome +
                       ", on_error: " + error_outcome);
          const auto node = std::make_shared<TestNode>();
          node->go_to(row.start);
          node->actions[row.via] = action;
          node->actions[errorprocessing] = error_action;
          const TransitionResult result =
              by_label ? node->trigger_transition(row.label)
                       : node->trigger_transition(static_cast<TransitionId>(row.id));
          const LifecycleState end = outcome == "success"         ? row.success
                                     : outcome == "failure"       ? row.failure
                                     : error_outcome == "success" ? unconfigured
                                                                  : finalized;
          EXPECT_EQ(node->get_current_state(), end);
          EXPECT_EQ(result.state, end);
          EXPECT_EQ(static_cast<bool>(result), outcome == "success");
          EXPECT_EQ(result.message.empty(), outcome == "success");
          if (is_error) {
            EXPECT_EQ(result.returned, CallbackReturn::ERROR);
            EXPECT_THAT(node->path, ElementsAre(row.via, errorprocessing, end));
            EXPECT_THAT(node->calls, ElementsAre(std::pair(row.via, row.start),
                                                 std::pair(errorprocessing, row.start)));
          } else {
            EXPECT_EQ(result.returned,
                      outcome == "success" ? CallbackReturn::SUCCESS : CallbackReturn::FAILURE);
            EXPECT_THAT(node->path, ElementsAre(row.via, end));
            EXPECT_THAT(node->calls, ElementsAre(std::pair(row.via, row.start)));
          }
        }
      }
    }
  }
}

TEST(LifecycleNode, RefusesWhatCannotBeInItsState) {
  for (const LifecycleState state : {unconfigured, inactive, active, finalized}) {
    const auto node = std::make_shared<TestNode>();
    node->go_to(state);
    for (int id = 0; id < 256; ++id) {
      if (std::any_of(kTable.begin(), kTable.end(),
                      [&](const Row& row) { return row.start == state && row.id == id; })) {
        continue;
      }
      const TransitionResult result = node->trigger_transition(static_cast<TransitionId>(id));
      EXPECT_FALSE(result);
      EXPECT_EQ(result.returned, std::nullopt);
      EXPECT_EQ(result.state, state);
    }
    for (const char* name : {"", "nonsense", "create", "destroy", "transition_success"}) {
      EXPECT_EQ(node->trigger_transition(name).returned, std::nullopt);
    }
    EXPECT_EQ(node->get_current_state(), state);
    EXPECT_THAT(node->path, IsEmpty());
    EXPECT_THAT(node->calls, IsEmpty());
  }
}

TEST(LifecycleNode, SaysWhyItRefusesAndWhatCanBeAskedFor) {
  const auto node = std::make_shared<TestNode>();
  EXPECT_EQ(node->activate().message,
            "'activate' of node '/node' was refused: the node is unconfigured; possible are: "
            "'configure' (1), 'shutdown' (5)");
  EXPECT_TRUE(node->shutdown());
  EXPECT_EQ(node->trigger_transition(TransitionId::cleanup).message,
            "transition 2 of node '/node' was refused: the node is finalized; possible are: none");
}

TEST(LifecycleNode, SaysHowATransitionWithoutSuccessEnded) {
  const auto node = std::make_shared<TestNode>();
  node->actions[configuring] = [] { return CallbackReturn::FAILURE; };
  EXPECT_EQ(node->configure().message,
            "'configure' of node '/node' ended with a failure: the node is unconfigured; possible "
            "are: 'configure' (1), 'shutdown' (5)");
  node->actions[configuring] = [] { return CallbackReturn::ERROR; };
  EXPECT_EQ(node->configure().message,
            "'configure' of node '/node' ended with an error: the node is finalized; possible are: "
            "none");
}

TEST(LifecycleNode, RefusesARequestFromOneOfItsOwnCallbacks) {
  const auto node = std::make_shared<TestNode>();
  TransitionResult inner;
  node->actions[configuring] = [&] {
    inner = node->shutdown();
    return CallbackReturn::SUCCESS;
  };
  EXPECT_TRUE(node->configure());
  EXPECT_EQ(inner.returned, std::nullopt);
  EXPECT_EQ(inner.state, configuring);
  EXPECT_THAT(inner.message, HasSubstr("another transition is under way, in state 'configuring'"));
  EXPECT_TRUE(node->activate());
}

TEST(LifecycleNode, RefusesARequestFromAnotherThreadDuringATransition) {
  const auto node = std::make_shared<TestNode>();
  TransitionResult other;
  node->actions[configuring] = [&] {
    std::thread([&] { other = node->shutdown(); }).join();  // a lock would wait for ever
    return CallbackReturn::SUCCESS;
  };
  EXPECT_TRUE(node->configure());
  EXPECT_EQ(other.returned, std::nullopt);
}

TEST(LifecycleNode, OfRequestsAtTheSameTimeOneIsServed) {
  const auto node = std::make_shared<TestNode>();
  node->go_to(inactive);
  for (int round = 0; round < 100; ++round) {
    std::atomic<int> served{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] { served += node->activate() ? 1 : 0; });
    }
    for (auto& thread : threads) thread.join();
    ASSERT_EQ(served, 1);
    ASSERT_EQ(node->get_current_state(), active);
    ASSERT_TRUE(node->deactivate());
  }
}

// It was called under a lock that replacing it needs.
TEST(LifecycleNode, AListenerOfTransitionsMayReplaceItself) {
  LifecycleNode node("node");
  std::vector<std::string> heard;
  const auto owned = std::make_shared<int>(0);
  node.set_transition_listener([&, owned](const LifecycleTransition& transition) {
    heard.push_back("first: " + std::string(label(transition.goal)));
    node.set_transition_listener([&](const LifecycleTransition& next) {
      heard.push_back("second: " + std::string(label(next.goal)));
    });
    EXPECT_EQ(owned.use_count(), 2);  // its call goes on with what it owns
  });
  EXPECT_TRUE(node.configure());
  EXPECT_EQ(owned.use_count(), 1);
  EXPECT_THAT(heard, ElementsAre("first: configuring", "second: inactive"));
}

TEST(LifecycleNode, WithoutOverridesSucceedsAndEndsAfterAnError) {
  const auto node = std::make_shared<LifecycleNode>("plain");
  EXPECT_EQ(node->get_current_state(), unconfigured);
  EXPECT_TRUE(node->configure());
  EXPECT_TRUE(node->activate());
  EXPECT_TRUE(node->deactivate());
  EXPECT_TRUE(node->cleanup());
  EXPECT_TRUE(node->shutdown());
  const auto failing = std::make_shared<TestNode>();
  failing->actions[configuring] = [] { return CallbackReturn::ERROR; };
  EXPECT_EQ(failing->configure().state, finalized);
}

}  // namespace
}  // namespace takt
