// A pool that runs a limited number of callbacks of each chain.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <vector>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/nodes/chain.hpp"

namespace takt::conformance {
namespace {

class ChainLimits : public ::testing::TestWithParam<const char*> {
 protected:
  /// A chain of one timer in a reentrant group, each execution of which takes 3 ms.
  void add(const std::string& name, int priority, std::uint32_t concurrency) {
    const auto group = node_->create_callback_group(name, CallbackGroupType::Reentrant);
    timers_.push_back(node_->create_timer(name, 1ms, body(name), group));
    timers_.back()->set_parameters({.priority = priority, .releases = 100});
    chains_.push_back(Chain::create(
        {.name = name, .priority = priority, .concurrency = concurrency}, {{node_, name}}));
  }
  std::function<void()> body(const std::string& name) {
    return [this, name] {
      most_[name] = std::max(most_[name], ++running_[name]);
      starts_[name].push_back(static_cast<int>(clock_.now().time_since_epoch() / 1ms));
      clock_.work(3ms);
      --running_[name];
    };
  }
  void run(std::size_t threads, Nanoseconds duration, bool limits_chains = true) {
    const auto executor =
        executors().make(GetParam(), {.scheduler = "fixed_priority",
                                      .threads = std::vector<ThreadAttributes>(threads),
                                      .limits_chains = limits_chains,
                                      .clock = &clock_});
    executor->add_node(node_);
    const ManualSpin spin(*executor, clock_, threads);
    clock_.advance(duration);
  }

  ManualClock clock_;
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<Timer::SharedPtr> timers_;
  std::vector<std::shared_ptr<Chain>> chains_;
  std::map<std::string, int> running_, most_;
  std::map<std::string, std::vector<int>> starts_;
};

TEST_P(ChainLimits, RunAsManyOfEachChainAsMay) {
  add("two", 9, 2);
  add("one", 5, 1);
  add("any", 1, 0);
  run(6, 20ms);
  EXPECT_EQ(most_["two"], 2);
  EXPECT_EQ(most_["one"], 1);
  EXPECT_EQ(most_["any"], 3);  // a release each 1 ms, for 3 ms
}

TEST_P(ChainLimits, AreNotHeededWithoutThem) {
  add("two", 9, 2);
  run(6, 20ms, false);
  EXPECT_EQ(most_["two"], 3);
}

// What waits for its chain holds up no other, and goes on when there is room, at once.
TEST_P(ChainLimits, LetOthersGoFirst) {
  add("urgent", 9, 1);
  add("other", 1, 0);
  run(2, 10ms);
  EXPECT_THAT(starts_["urgent"], ElementsAre(1, 4, 7, 10));
  EXPECT_THAT(starts_["other"], ElementsAre(1, 4, 7, 10));
}

// A callback of a chain that sleeping workers wait for wakes one of them.
TEST_P(ChainLimits, WakeAWorkerWhenThereIsRoom) {
  const auto group = node_->create_callback_group("g", CallbackGroupType::Reentrant);
  const auto subscription = node_->create_subscription<Number>(
      "t", 9, [run = body("limited")](const Number&) { run(); }, group);
  chains_.push_back(Chain::create({.name = "c", .concurrency = 2}, {{node_, "t"}}));
  const auto publisher = node_->create_publisher<Number>("t", 9);
  for (int i = 0; i < 5; ++i) publisher->publish(Number{i});
  run(4, 20ms);
  EXPECT_THAT(starts_["limited"], ElementsAre(0, 0, 3, 3, 6));
}

INSTANTIATE_TEST_SUITE_P(OfPools, ChainLimits, ::testing::Values("events", "multi_threaded"),
                         [](const auto& suite) { return std::string(suite.param); });

}  // namespace
}  // namespace takt::conformance
