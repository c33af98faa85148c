// The parts of an executor that a user brings: a rule, an order, keys of its own.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/kit/kit_test.hpp"

namespace takt::conformance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

struct EarliestRoot {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    return a.root_ready_time < b.root_ready_time;
  }
};
TAKT_REGISTER_SCHEDULER("earliest_root", "for tests", HeapScheduler<EarliestRoot>)
TAKT_REGISTER_EXECUTOR("windows", "for tests", .readiness = Readiness::events, .scheduler = "fifo",
                       .rule = make_rule<Windows>, .keys = {{"width", "of a window"}})
TAKT_REGISTER_EXECUTOR("windows_of_snapshots", "for tests", .readiness = Readiness::wait_set,
                       .scheduler = "fifo", .rule = make_rule<Windows>)
TAKT_REGISTER_EXECUTOR("budget_of_two", "for tests", .readiness = Readiness::events,
                       .scheduler = "fifo", .max_threads = 2, .rule = make_rule<Budget>,
                       .workers = make_workers_policy<TwoBands>)
TAKT_REGISTER_EXECUTOR("windows_of_two", "for tests", .readiness = Readiness::wait_set,
                       .scheduler = "fifo", .max_threads = 2, .rule = make_rule<Windows>,
                       .workers = make_workers_policy<TwoBands>)
TAKT_REGISTER_EXECUTOR("budget", "for tests", .readiness = Readiness::events, .scheduler = "fifo",
                       .rule = make_rule<Budget>)
TAKT_REGISTER_EXECUTOR("two_bands", "for tests", .readiness = Readiness::events,
                       .scheduler = "fifo", .max_threads = 2,
                       .workers = make_workers_policy<TwoBands>)

TAKT_REGISTER_EXECUTOR("any_of_two", "for tests", .readiness = Readiness::events,
                       .scheduler = "fifo", .max_threads = 2,
                       .workers = make_workers_policy<AnyOfTwo>)

TEST_F(Kit, ARuleHoldsBackWhatItDoesNotAdmitInItsOrder) {
  const auto even = subscribe("even"), odd = subscribe("odd"), other = subscribe("other");
  const auto executor = make("windows");
  const ManualSpin spin(*executor, clock_, 1);
  send("odd", 1);
  send("even", 2);
  send("odd", 3);
  send("other", 4);
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("even2@0", "other4@0"));
  EXPECT_EQ(executor->pending(), 1u);  // its window will come
  send("even", 5);
  clock_.advance(9ms);
  clock_.advance(1ms);
  EXPECT_THAT(trace_, ElementsAre("even2@0", "other4@0", "even5@0", "odd1@10", "odd3@10"));
  trace_.clear();
  send("even", 6);
  clock_.advance(5ms);
  EXPECT_THAT(trace_, IsEmpty());
  clock_.advance(5ms);
  EXPECT_THAT(trace_, ElementsAre("even6@20"));
}

// The rest of a snapshot was put aside, and what had come since was not looked at.
TEST_F(Kit, ASnapshotThatIsPutAsideIsOver) {
  const auto even = subscribe("even"), odd = subscribe("odd");
  const auto executor = make("windows_of_snapshots");
  send("odd", 1);
  for (int i = 0; i < 3; ++i) send("even", i);
  const ManualSpin spin(*executor, clock_, 1);
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("even0@0", "even1@0", "even2@0"));
}

// The same where what is left is for another worker.
// Workers that are told apart looked again and again while the rule was closed.
// Each search of the urgent worker turned the others' order round.
TEST_F(Kit, AnIdleExecutorDoesNotWakeForItsRule) {
  const auto even = subscribe("even");
  const auto executor = make("windows");
  const ManualSpin spin(*executor, clock_, 1);
  clock_.settle();
  const int before = Windows::looks;
  clock_.advance(1s);
  EXPECT_EQ(Windows::looks, before);
}

TEST_F(Kit, WhatIsHeldBackCanBeRemovedAtRest) {
  auto odd = subscribe("odd");
  const auto even = subscribe("even");
  const auto executor = make("windows");
  send("odd", 1);
  send("even", 2);
  executor->spin_some();
  odd.reset();
  clock_.advance(10ms);
  executor->spin_some();
  EXPECT_THAT(trace_, ElementsAre("even2@0"));
  odd = subscribe("odd");
  send("odd", 3);
  executor->spin_some();
  EXPECT_THAT(trace_, ElementsAre("even2@0", "odd3@10"));
}

TEST_F(Kit, WhatIsHeldBackCanBeRemovedByACallback) {
  auto odd = subscribe("odd");
  const auto even =
      node_->create_subscription<Number>("even", 9, [&](const Number&) { odd.reset(); });
  const auto executor = make("windows");
  const ManualSpin spin(*executor, clock_, 1);
  send("odd", 1);
  send("even", 2);
  clock_.advance(20ms);
  EXPECT_EQ(odd, nullptr);
  EXPECT_THAT(trace_, IsEmpty());
}

TEST_F(Kit, SpinSomeServesWhatTheRuleAdmits) {
  const auto even = subscribe("even"), odd = subscribe("odd");
  const auto executor = make("windows");
  send("odd", 1);
  send("even", 2);
  executor->spin_some();
  EXPECT_THAT(trace_, ElementsAre("even2@0"));
  clock_.advance(10ms);
  executor->spin_all();
  EXPECT_THAT(trace_, ElementsAre("even2@0", "odd1@10"));
}

TEST_F(Kit, ARuleMayRefuseACallback) {
  const auto executor = make("windows");
  EXPECT_THAT([&] { subscribe("refused"); },
              ThrowsMessage<Error>(HasSubstr("this rule refuses it")));
  const auto even = subscribe("even");
  send("even", 1);
  executor->spin_some();
  EXPECT_THAT(trace_, ElementsAre("even1@0"));
}

TEST_F(Kit, ABudgetIsRefilledByTime) {
  const auto a = subscribe("a", 2ms);
  const auto executor = make("budget");
  const ManualSpin spin(*executor, clock_, 1);
  for (int i = 0; i < 5; ++i) send("a", i);
  clock_.advance(100ms);
  EXPECT_THAT(trace_, ElementsAre("a0@0", "a1@2", "a2@10", "a3@12", "a4@20"));
  const auto rows = executor->statistics();
  EXPECT_EQ(rows.at(0).received, 5u);
  EXPECT_EQ(rows.at(0).dropped, 0u);
}

TEST_F(Kit, AnOrderSeesWhenTheRootOfAChainWasReleased) {
  const auto late = subscribe("late");
  auto to_late = node_->create_publisher<Number>("late", 9);
  const auto early = node_->create_timer("early", 10ms, [&] {
    clock_.work(2ms);
    to_late->publish(Number{1});
  });
  const auto between = node_->create_timer("between", 11ms, [&] { trace_.push_back("between"); });
  const auto executor =
      executors().make("events", {.scheduler = "earliest_root", .clock = &clock_});
  executor->add_node(node_);
  clock_.advance(10ms);
  executor->spin_some();
  executor->spin_some();
  EXPECT_THAT(trace_, ElementsAre("late1@12", "between"));
}

TEST_F(Kit, RefusesKeysOfOthersAndNumbersThatAreNone) {
  for (const char* type : {"events", "isolated"}) {
    EXPECT_THAT([&] { executors().make(type, {.own = {{.name = "width"}}}); },
                ThrowsMessage<OwnValueError>(HasSubstr("'width': executor 'executor' is of a type "
                                                       "without this key")));
  }
  const OwnValue endless{.name = "width", .content = std::numeric_limits<double>::infinity()};
  EXPECT_THROW((void)endless.as_number(), OwnValueError);
  EXPECT_NO_THROW(executors().make("windows", {.own = {{.name = "width"}}}));
}

}  // namespace
}  // namespace takt::conformance
