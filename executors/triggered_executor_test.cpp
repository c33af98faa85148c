// When snapshots are served, in which order, and what logical execution time means.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;
using Kind = TriggerOptions::Kind;

class Triggered : public ::testing::Test {
 protected:
  std::unique_ptr<Executor> make(const TriggerOptions& trigger,
                                 const std::vector<std::string>& order = {}) {
    auto executor =
        executors().make("triggered", {.trigger = trigger, .order = order, .clock = &clock_});
    executor->add_node(node_);
    return executor;
  }
  int now_ms() const { return static_cast<int>(clock_.now().time_since_epoch() / 1ms); }
  std::shared_ptr<Subscription<Number>> subscribe(const std::string& topic) {
    return node_->create_subscription<Number>(topic, 5, [this, topic](const Number& number) {
      trace_.push_back(topic + std::to_string(number.value));
    });
  }

  ManualClock clock_;
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<std::string> trace_;
  std::shared_ptr<Subscription<Number>> a_ = subscribe("a"), b_ = subscribe("b");
  std::shared_ptr<Publisher<Number>> to_a_ = node_->create_publisher<Number>("a", 5),
                                     to_b_ = node_->create_publisher<Number>("b", 5);
};

TEST_F(Triggered, AnyServesWhateverIsReadyInTheListedOrder) {
  const auto executor = make({}, {"node/b", "node/a"});
  to_a_->publish(Number{1});
  executor->spin_some();
  to_a_->publish(Number{2});
  to_b_->publish(Number{3});
  executor->spin_some();
  EXPECT_THAT(trace_, ElementsAre("a1", "b3", "a2"));
}

TEST_F(Triggered, AllWaitsUntilEveryCallbackIsReady) {
  const auto executor = make({.kind = Kind::all});
  const ManualSpin spin(*executor, clock_, 1);
  to_a_->publish(Number{1});
  clock_.settle();
  EXPECT_THAT(trace_, IsEmpty());
  EXPECT_EQ(executor->pending(), 0u);  // it may wait for ever
  to_a_->publish(Number{2});
  to_b_->publish(Number{3});
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("a1", "b3"));  // one of each; another a waits for another b
  to_b_->publish(Number{4});
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("a1", "b3", "a2", "b4"));
}

TEST_F(Triggered, OneWaitsForThatCallbackAndServesAll) {
  const auto executor = make({.kind = Kind::one, .one = "/node/b"});
  const ManualSpin spin(*executor, clock_, 1);
  to_a_->publish(Number{1});
  clock_.settle();
  EXPECT_THAT(trace_, IsEmpty());
  to_b_->publish(Number{2});
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("a1", "b2"));
}

TEST_F(Triggered, WhatWaitedLongerHasNoPrecedenceOverTheUsersOrder) {
  const auto executor = make({.kind = Kind::one, .one = "/node/b"}, {"node/b", "node/a"});
  const ManualSpin spin(*executor, clock_, 1);
  to_a_->publish(Number{1});
  clock_.settle();
  to_b_->publish(Number{2});
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("b2", "a1"));
}

TEST_F(Triggered, TheUsersOwnFunctionSeesWhoIsReady) {
  const auto executor = make({.own = [](std::span<const TriggerInput> inputs) {
    EXPECT_EQ(inputs.size(), 2u);
    EXPECT_EQ(inputs[0].node, "/node");
    EXPECT_EQ(inputs[0].callback, "a");
    return inputs[1].is_ready && !inputs[0].is_ready;
  }});
  const ManualSpin spin(*executor, clock_, 1);
  to_b_->publish(Number{1});
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("b1"));
  to_a_->publish(Number{2});
  clock_.settle();
  to_b_->publish(Number{3});
  clock_.settle();
  EXPECT_THAT(trace_, ElementsAre("b1"));
}

TEST_F(Triggered, WhatWaitsForTheTriggerIsNotLost) {
  const auto executor = make({.kind = Kind::all});
  to_a_->publish(Number{1});
  executor->spin_some();
  for (const CallbackStatistics& statistics : executor->statistics()) {
    EXPECT_EQ(statistics.received, 0u);
    EXPECT_EQ(statistics.expected, 0u);
  }
}

// ---- Logical execution time ----

TEST_F(Triggered, LetTakesInputsTogetherAndSendsOutputsAtTheEndOfThePeriod) {
  const auto out = node_->create_publisher<Number>("out", 5);
  const auto source = node_->create_subscription<Number>("in", 5, [&](const Number& number) {
    trace_.push_back("in at " + std::to_string(now_ms()));
    clock_.work(3ms);
    out->publish(number);
    // Inputs were taken at the release: this one comes too late for the period.
    if (number.value == 1) to_b_->publish(Number{9});
  });
  const auto to_in = node_->create_publisher<Number>("in", 5);
  const auto outside = std::make_shared<Node>("outside", NodeOptions{.clock = &clock_});
  std::vector<int> arrivals_ms;
  const auto listener = executors().make("single_threaded", {.clock = &clock_});
  const auto sink = outside->create_subscription<Number>(
      "out", 5, [&](const Number&) { arrivals_ms.push_back(now_ms()); });
  listener->add_node(outside);
  const auto executor = make({.let_period = 10ms});
  const ManualSpin listening(*listener, clock_, 1);
  const ManualSpin spin(*executor, clock_, 2);
  clock_.advance(4ms);
  to_in->publish(Number{1});
  clock_.advance(40ms);
  EXPECT_THAT(trace_, ElementsAre("in at 10", "b9"));
  EXPECT_THAT(arrivals_ms, ElementsAre(20));
}

TEST_F(Triggered, LetCountsPeriodsThatWereMissedAndKeepsItsPhase) {
  std::vector<int> starts_ms;
  const auto timer = node_->create_timer("timer", 10ms, [&] {
    starts_ms.push_back(now_ms());
    clock_.work(starts_ms.size() == 1 ? 25ms : 1ms);
  });
  auto executor = make({.let_period = 10ms});
  {
    const ManualSpin spin(*executor, clock_, 1);
    clock_.advance(65ms);
    timer->cancel();
  }
  EXPECT_THAT(starts_ms, ElementsAre(10, 35, 40, 50, 60));
  EXPECT_EQ(executor->thread_statistics().at(0).missed_periods, 1u);
}

TEST_F(Triggered, LetDropsAndCountsWhatDoesNotFit) {
  const auto publisher = node_->create_publisher<Number>("out", 5);
  const auto timer = node_->create_timer("timer", 10ms, [&] {
    for (int i = 0; i < 5; ++i) publisher->publish(Number{i});
  });
  int received = 0;
  const auto sink =
      node_->create_subscription<Number>("out", 5, [&](const Number&) { ++received; });
  auto executor = make({.let_period = 10ms, .most_outputs = 3});
  {
    const ManualSpin spin(*executor, clock_, 1);
    clock_.advance(15ms);
    timer->cancel();
    clock_.advance(50ms);
  }
  EXPECT_EQ(received, 3);
  EXPECT_EQ(executor->thread_statistics().at(0).dropped_outputs, 2u);
}

TEST_F(Triggered, APublisherMayGoBeforeThePeriodEnds) {
  auto publisher = node_->create_publisher<Number>("a", 5);
  const auto timer = node_->create_timer("timer", 10ms, [&] {
    publisher->publish(Number{1});
    publisher.reset();
  });
  const auto executor = make({.let_period = 10ms});
  const ManualSpin spin(*executor, clock_, 1);
  clock_.advance(15ms);
  timer->cancel();
  clock_.advance(30ms);
  EXPECT_THAT(trace_, IsEmpty());
}

TEST_F(Triggered, ACallbackMayDropAnotherWhoseInputIsTaken) {
  const auto first = node_->create_callback_group("first", CallbackGroupType::MutuallyExclusive);
  const auto killer = node_->create_subscription<Number>(
      "kill", 5, [&](const Number&) { b_.reset(); }, first);
  const auto to_kill = node_->create_publisher<Number>("kill", 5);
  const auto executor = make({.let_period = 10ms}, {"node/kill"});
  const ManualSpin spin(*executor, clock_, 1);
  clock_.settle();
  to_b_->publish(Number{1});
  to_kill->publish(Number{2});
  clock_.advance(15ms);
  EXPECT_THAT(trace_, IsEmpty());
}

// The same where the record is given back as soon as the callback begins.
TEST_F(Triggered, ACallbackMayDropAReentrantOneWhoseInputIsTaken) {
  const auto reentrant = node_->create_callback_group("reentrant", CallbackGroupType::Reentrant);
  auto victim = node_->create_subscription<Number>(
      "victim", 5, [&](const Number&) { trace_.push_back("victim"); }, reentrant);
  const auto killer = node_->create_subscription<Number>(
      "kill", 5, [&](const Number&) { victim.reset(); }, reentrant);
  const auto to_victim = node_->create_publisher<Number>("victim", 5);
  const auto to_kill = node_->create_publisher<Number>("kill", 5);
  const auto executor = make({.let_period = 10ms}, {"node/kill"});
  const ManualSpin spin(*executor, clock_, 1);
  clock_.settle();
  to_victim->publish(Number{1});
  to_kill->publish(Number{2});
  clock_.advance(35ms);
  EXPECT_THAT(trace_, IsEmpty());
}

TEST_F(Triggered, AllocatesNothingWhileItSpins) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto out = node_->create_publisher<Number>("out", 5, {.loans = 20});
  int count = 0;
  const auto timer = node_->create_timer("timer", 10ms, [&] {
    auto message = out->borrow_loaned_message();
    message->value = ++count;
    out->publish(std::move(message));
  });
  const auto sink = node_->create_subscription<Number>("out", 5, [&](const Number&) { ++count; });
  auto executor = make({.let_period = 10ms});
  {
    const ManualSpin spin(*executor, clock_, 1);
    clock_.advance(1s);
    timer->cancel();
  }
  EXPECT_EQ(count, 199);  // the last message would be published a period later
  EXPECT_EQ(executor->thread_statistics().at(0).counters.allocations, 0u);
}

// ---- What cannot be ----

TEST(TriggerOptionsOf, OtherExecutorsAreRefused) {
  EXPECT_THAT([] { executors().make("events", {.trigger = {.kind = Kind::all}}); },
              ThrowsMessage<Error>(HasSubstr("choose 'triggered'")));
  EXPECT_THAT([] { executors().make("events", {.trigger = {.let_period = 1ms}}); },
              ThrowsMessage<Error>(HasSubstr("choose 'triggered'")));
  EXPECT_THAT([] { executors().make("triggered", {.trigger = {.kind = Kind::one}}); },
              ThrowsMessage<Error>(HasSubstr("without a callback")));
  EXPECT_THAT([] { executors().make("triggered", {.trigger = {.let_period = -1ms}}); },
              ThrowsMessage<Error>(HasSubstr("give a positive one")));
}

}  // namespace
}  // namespace takt::conformance
