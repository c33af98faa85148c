// A lifecycle node for tests: does what the test says, and notes its transitions.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_LIFECYCLE_NODE_TEST_HPP_
#define TAKT_NODES_LIFECYCLE_NODE_TEST_HPP_

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "takt/nodes/lifecycle_node.hpp"

namespace takt {

class TestNode : public LifecycleNode {
 public:
  using enum LifecycleState;
  using Action = std::function<CallbackReturn()>;

  explicit TestNode(const NodeOptions& options = {}) : LifecycleNode("node", options) {
    set_transition_listener([this](const LifecycleTransition& transition) {
      path.push_back(transition.goal);
      EXPECT_EQ(transition.goal, get_current_state());
    });
  }
  ~TestNode() override { set_transition_listener({}); }

  void go_to(LifecycleState state) {
    if (state == inactive || state == active) {
      ASSERT_TRUE(configure());
    }
    if (state == active) {
      ASSERT_TRUE(activate());
    }
    if (state == finalized) {
      ASSERT_TRUE(shutdown());
    }
    ASSERT_EQ(get_current_state(), state);
    path.clear();
    calls.clear();
  }

  std::map<LifecycleState, Action> actions;  // what is not here succeeds; on_error fails
  std::vector<LifecycleState> path;
  std::vector<std::pair<LifecycleState, LifecycleState>> calls;  // during, previous

 private:
  CallbackReturn act(LifecycleState during, LifecycleState previous) {
    EXPECT_EQ(get_current_state(), during);
    calls.emplace_back(during, previous);
    const auto action = actions.find(during);
    return action == actions.end() ? CallbackReturn::SUCCESS : action->second();
  }
  CallbackReturn on_configure(LifecycleState from) override { return act(configuring, from); }
  CallbackReturn on_cleanup(LifecycleState from) override { return act(cleaningup, from); }
  CallbackReturn on_activate(LifecycleState from) override { return act(activating, from); }
  CallbackReturn on_deactivate(LifecycleState from) override { return act(deactivating, from); }
  CallbackReturn on_shutdown(LifecycleState from) override { return act(shuttingdown, from); }
  CallbackReturn on_error(LifecycleState from) override {
    if (!actions.contains(errorprocessing)) {
      calls.emplace_back(errorprocessing, from);
      return LifecycleNode::on_error(from);
    }
    return act(errorprocessing, from);
  }
};

}  // namespace takt

#endif  // TAKT_NODES_LIFECYCLE_NODE_TEST_HPP_
