// Bringing lifecycle nodes up and down, and what happens when one is lost.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/lifecycle_manager.hpp"

#include <future>
#include <map>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/executors/executor.hpp"
#include "takt/ros2/lifecycle_services.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Trace = std::vector<std::string>;

/// Notes each transition; `fails` is the one that fails.
class Managed : public LifecycleNode {
 public:
  Managed(const std::string& name, Clock& clock, Trace& trace)
      : LifecycleNode(name, {.clock = &clock}), trace_(trace) {}
  std::string fails;

 protected:
  CallbackReturn on_configure(LifecycleState) override { return note("configure"); }
  CallbackReturn on_activate(LifecycleState) override { return note("activate"); }
  CallbackReturn on_deactivate(LifecycleState) override { return note("deactivate"); }
  CallbackReturn on_cleanup(LifecycleState) override { return note("cleanup"); }
  CallbackReturn on_shutdown(LifecycleState) override { return note("shutdown"); }

 private:
  CallbackReturn note(const std::string& transition) {
    trace_.push_back(transition + " " + name());
    return transition == fails ? CallbackReturn::FAILURE : CallbackReturn::SUCCESS;
  }
  Trace& trace_;
};

/// A process with some of the nodes: what answers, and what beats.
struct Process {
  Process(const std::vector<std::string>& names, Clock& clock, Executor& executor, Trace& trace,
          Nanoseconds heartbeat)
      : host(std::make_shared<Node>("host" + names.front(), NodeOptions{.clock = &clock})),
        heartbeats(*host, heartbeat) {
    for (const std::string& name : names) {
      nodes.push_back(std::make_shared<Managed>(name, clock, trace));
      services.push_back(std::make_unique<LifecycleServices>(*nodes.back(), *host));
      sent.push_back(heartbeats.add(nodes.back()));
    }
    executor.add_node(host);
  }
  std::shared_ptr<Node> host;
  HeartbeatSender heartbeats;
  std::vector<std::shared_ptr<Managed>> nodes;
  std::vector<std::unique_ptr<LifecycleServices>> services;
  std::vector<std::shared_ptr<void>> sent;
};

class Lifecycle : public testing::Test {
 protected:
  using OnLoss = LifecycleDescription::OnLoss;

  void make(OnLoss on_loss, std::map<std::string, std::vector<std::string>> depends_on = {}) {
    LifecycleDescription description;
    description.heartbeat = 300ms;
    description.on_loss = on_loss;
    for (const char* name : {"/map", "/amcl", "/control"}) {
      description.bring_up.push_back({name, depends_on[name]});
    }
    begin("map", {"map"});
    begin("others", {"amcl", "control"});
    manager_node_ = std::make_shared<Node>("manager", NodeOptions{.clock = &clock_});
    manager_ = std::make_unique<LifecycleManager>(*manager_node_, description);
    executor_->add_node(manager_node_);
    manager_->bring_up();
  }
  void begin(const std::string& process, const std::vector<std::string>& names) {
    processes_[process] =
        std::make_unique<Process>(names, clock_, *executor_, trace_, Nanoseconds(300ms));
  }
  void run(Nanoseconds duration) {
    for (Nanoseconds passed{0}; passed < duration; passed += 10ms) {
      clock_.advance(10ms);
      executor_->spin_all();
    }
  }
  Managed& node(const std::string& process, std::size_t index = 0) {
    return *processes_.at(process)->nodes.at(index);
  }
  Trace take_trace() { return std::exchange(trace_, {}); }
  std::vector<std::string> shut_down() {
    auto left = std::async(std::launch::async, [this] { return manager_->shut_down(5s); });
    while (left.wait_for(0s) != std::future_status::ready) run(10ms);
    return left.get();
  }

  ManualClock clock_{TimePoint(1h)};
  Trace trace_;
  std::unique_ptr<Executor> executor_ =
      executors().make("events", {.name = "test", .clock = &clock_});
  std::map<std::string, std::unique_ptr<Process>> processes_;
  std::shared_ptr<Node> manager_node_;
  std::unique_ptr<LifecycleManager> manager_;
};

TEST_F(Lifecycle, ComesUpInOrderAndGoesDownInReverse) {
  make(OnLoss::report);
  run(1s);
  EXPECT_TRUE(manager_->is_up());
  EXPECT_THAT(take_trace(), ElementsAre("configure map", "activate map", "configure amcl",
                                        "activate amcl", "configure control", "activate control"));
  EXPECT_THAT(shut_down(), IsEmpty());
  EXPECT_THAT(take_trace(), ElementsAre("deactivate control", "cleanup control", "shutdown control",
                                        "deactivate amcl", "cleanup amcl", "shutdown amcl",
                                        "deactivate map", "cleanup map", "shutdown map"));
}

// It went on, and the run ended with status 0.
TEST_F(Lifecycle, ABringUpStopsAtANodeThatFailsAndSaysSo) {
  make(OnLoss::report);
  node("others", 0).fails = "activate";
  run(1s);
  EXPECT_FALSE(manager_->is_up());
  EXPECT_THAT(take_trace(),
              ElementsAre("configure map", "activate map", "configure amcl", "activate amcl"));
  EXPECT_THAT(manager_->failures(),
              ElementsAre("lifecycle: /amcl failed to activate; the bring-up stopped there"));
  node("others", 0).fails = "";
  EXPECT_THAT(shut_down(), IsEmpty());
}

TEST_F(Lifecycle, ABringUpWaitsForANodeThatNobodyHasAndGoesOnWhenItComes) {
  make(OnLoss::report);
  processes_.erase("map");
  run(1s);
  EXPECT_THAT(take_trace(), IsEmpty());
  EXPECT_THAT(manager_->failures(),
              ElementsAre("lifecycle: /map was not found; the bring-up stopped there"));
  begin("map", {"map"});
  run(1s);
  EXPECT_TRUE(manager_->is_up());
  EXPECT_THAT(manager_->failures(), IsEmpty());
}

TEST_F(Lifecycle, WhatDependsOnALostNodeRestsUntilItIsBack) {
  make(OnLoss::deactivate_dependents, {{"/amcl", {"/map"}}});
  run(1s);
  take_trace();
  processes_.erase("map");  // killed
  run(200ms);
  EXPECT_THAT(take_trace(), IsEmpty());  // not yet noticed
  run(200ms);
  EXPECT_THAT(take_trace(), ElementsAre("deactivate amcl"));
  EXPECT_EQ(node("others", 1).get_current_state(), LifecycleState::active);
  begin("map", {"map"});
  run(1s);
  EXPECT_THAT(take_trace(), ElementsAre("configure map", "activate map", "activate amcl"));
  EXPECT_TRUE(manager_->is_up());
}

// A process that is started again between two heartbeats never answers what the old one was asked.
TEST_F(Lifecycle, ARequestThatNobodyAnswersIsSentAgain) {
  const auto host = std::make_shared<Node>("host", NodeOptions{.clock = &clock_});
  std::vector<std::string> asked;
  const auto service = host->create_service<lifecycle_msgs::srv::ChangeState>(
      "/map/change_state",
      [&](const auto& request, RequestId) { asked.push_back(request.transition.label); });
  const auto publisher = host->create_publisher<Heartbeat>("/takt/heartbeat", 10);
  const auto beat = host->create_timer("beat", 100ms, [&] {
    publisher->publish(Heartbeat{"/map", static_cast<std::uint8_t>(LifecycleState::unconfigured)});
  });
  executor_->add_node(host);
  LifecycleDescription description;
  description.heartbeat = 300ms;
  description.bring_up.push_back({"/map", {}});
  manager_node_ = std::make_shared<Node>("manager", NodeOptions{.clock = &clock_});
  manager_ = std::make_unique<LifecycleManager>(*manager_node_, description);
  executor_->add_node(manager_node_);
  manager_->bring_up();
  run(29s);
  EXPECT_THAT(asked, ElementsAre("configure"));
  run(2s);
  EXPECT_THAT(asked, ElementsAre("configure", "configure"));
}

TEST_F(Lifecycle, ReportsALostNodeOnlyIfAskedTo) {
  make(OnLoss::report, {{"/amcl", {"/map"}}});
  run(1s);
  take_trace();
  processes_.erase("map");
  run(1s);
  EXPECT_THAT(take_trace(), IsEmpty());
  EXPECT_THAT(shut_down(), ElementsAre("/map"));
}

TEST_F(Lifecycle, ALostNodeTakesAllDownWhereThatIsAskedFor) {
  make(OnLoss::shutdown);
  run(1s);
  take_trace();
  processes_.erase("map");
  run(1s);
  EXPECT_THAT(take_trace(), ElementsAre("deactivate control", "cleanup control", "shutdown control",
                                        "deactivate amcl", "cleanup amcl", "shutdown amcl"));
}

TEST_F(Lifecycle, WhoIsDeactivatedBySomebodyElseIsLeftSo) {
  make(OnLoss::deactivate_dependents, {{"/amcl", {"/map"}}});
  run(1s);
  take_trace();
  node("map").deactivate();
  run(1s);
  EXPECT_THAT(take_trace(), ElementsAre("deactivate map", "deactivate amcl"));
  node("map").activate();
  run(1s);
  EXPECT_THAT(take_trace(), ElementsAre("activate map", "activate amcl"));
}

}  // namespace
}  // namespace takt::test
