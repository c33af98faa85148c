// Modes: what leads to them, what each does with callbacks, and that nothing is lost by it.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/modes.hpp"

#include <atomic>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/logger.hpp"
#include "takt/containers/modes_test.hpp"
#include "takt/testing/sanitized.hpp"

namespace takt::modes_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A container under the manual clock.
class Box {
 public:
  explicit Box(const std::string& modes = kModes, const std::string& more = "")
      : container_(system_of(file_of(modes, more)), {.clock = &world_.clock}) {
    modes_test::world = &world_;
    container_.start();
    world_.clock.wait_for_participants(kThreads);
    container_.release();
  }
  ~Box() {
    if (!is_over_) end();
    modes_test::world = nullptr;
  }
  ProcessResult end() {
    is_over_ = true;
    container_.hold();
    container_.cancel();
    world_.clock.advance(1h);
    container_.join();
    return container_.result();
  }
  CallbackStatistics of(const ProcessResult& result, const std::string& callback) const {
    for (const auto& each : result.callbacks) {
      if (each.statistics.callback == callback) return each.statistics;
    }
    ADD_FAILURE() << "no callback " << callback;
    return {};
  }
  std::vector<std::string> ran_in(Nanoseconds time) {
    world_.clock.advance(time);
    return world_.take();
  }
  Container& operator*() { return container_; }
  Container* operator->() { return &container_; }
  World& world() { return world_; }

 private:
  static constexpr std::size_t kThreads = 5;  // default, container, and three requests
  World world_;
  Container container_;
  bool is_over_ = false;
};

TEST(Modes, ADemotedCallbackOvertakesNothingAndComesBack) {
  Box box;
  EXPECT_EQ(box->mode(), "normal");
  EXPECT_THAT(box.ran_in(15ms), ElementsAre("loop@10", "plan@10", "log@10"));
  box->set_mode("degraded");
  EXPECT_EQ(box->mode(), "degraded");
  EXPECT_THAT(box.ran_in(10ms), ElementsAre("loop@20", "log@20", "plan@20"));
  box->set_mode("normal");
  EXPECT_THAT(box.ran_in(10ms), ElementsAre("loop@30", "plan@30", "log@30"));
}

// The mode takes effect between two callbacks of one instant: what waits goes to its new place.
TEST(Modes, WhatWaitsWhenTheModeChangesIsServedAsTheModeSays) {
  Box box;
  box.world().in_callback = [&](const std::string& name) {
    if (name != "loop") return;
    EXPECT_TRUE(Robot::last->request_mode("degraded"));
    box.world().clock.work(1ms);  // meanwhile the container's thread switches
  };
  EXPECT_THAT(box.ran_in(15ms), ElementsAre("loop@10", "log@11", "plan@11"));
  EXPECT_EQ(box->mode(), "degraded");
}

TEST(Modes, WhatIsDroppedIsCountedAndNothingIsLost) {
  Box box;
  const auto eye = std::make_shared<Node>("eye");
  const auto publisher = eye->create_publisher<Image>("image", 10);
  const auto publish = [&](int messages) {
    for (int i = 0; i < messages; ++i) publisher->publish(Image{i});
    box.world().clock.settle();
  };
  publish(3);
  box->set_mode("degraded");
  publish(4);
  box->set_mode("normal");
  publish(2);
  EXPECT_THAT(box.world().take(),
              ElementsAre("image@0", "image@0", "image@0", "image@0", "image@0"));
  const CallbackStatistics image = box.of(box.end(), "image");
  EXPECT_EQ(image.received, 5u);
  EXPECT_EQ(image.dropped_by_mode, 4u);
  EXPECT_EQ(image.dropped, 0u);
  EXPECT_EQ(image.expected, 9u);
  EXPECT_EQ(image.lost(), 0u);
}

TEST(Modes, ADroppedTimerKeepsItsPhase) {
  Box box;
  EXPECT_THAT(box.ran_in(15ms), ElementsAre("loop@10", "plan@10", "log@10"));
  box->set_mode("safe");
  EXPECT_THAT(box.ran_in(28ms), ElementsAre("loop@20", "loop@30", "loop@40"));  // to 43 ms
  box->set_mode("normal");
  EXPECT_THAT(box.ran_in(10ms), ElementsAre("loop@50", "plan@50", "log@50"));
  const CallbackStatistics plan = box.of(box.end(), "plan");
  EXPECT_EQ(plan.received, 2u);
  EXPECT_EQ(plan.dropped_by_mode, 3u);
  EXPECT_EQ(plan.skipped, 0u);
  EXPECT_EQ(plan.expected, 5u);
}

// Not at once: the container's thread must have run.
TEST(Modes, AnOverrunLeadsToItsMode) {
  Box box;
  box.world().in_callback = [&](const std::string& name) {
    if (name == "loop") box.world().clock.work(3ms);
  };
  EXPECT_THAT(box.ran_in(15ms), ElementsAre("loop@10", "plan@13", "log@13"));
  EXPECT_EQ(box->mode(), "degraded");
  EXPECT_THAT(box.ran_in(10ms), ElementsAre("loop@20", "log@23", "plan@23"));
  const auto switches = box.end().mode_switches;
  ASSERT_EQ(switches.size(), 1u);
  EXPECT_EQ(switches[0].mode, "degraded");
  EXPECT_EQ(switches[0].cause, "'robot/loop' has overrun");
  EXPECT_EQ(switches[0].begin_ns, Nanoseconds(13ms).count());
}

TEST(Modes, AMissedDeadlineLeadsToItsModeToo) {
  Box box(
      "modes: {late: {drop: [robot/log], on: {overrun: worker/work}}}\n",
      "    - {component: test::ModesWorker, name: worker, callbacks: {work: {deadline: 1ms}}}\n");
  box.ran_in(15ms);
  EXPECT_EQ(box->mode(), "late");
}

TEST(Modes, AnOverrunNeverLeadsBack) {
  Box box;
  box->set_mode("safe");
  box.world().in_callback = [&](const std::string& name) {
    if (name == "loop") box.world().clock.work(3ms);
  };
  EXPECT_THAT(box.ran_in(15ms), ElementsAre("loop@10"));
  EXPECT_EQ(box->mode(), "safe");
  box->set_mode("normal");  // the next one leads to it again
  box.ran_in(10ms);
  EXPECT_EQ(box->mode(), "degraded");
}

TEST(Modes, AUsersHandlerOfOverrunsIsCalledBesides) {
  const auto modes = std::make_shared<Modes>(std::vector<ModeDescription>{
      {.name = "degraded", .on_overrun = ModeDescription::Callback{"robot/loop", ""}}});
  int calls = 0;
  const OverrunHandler handler =
      OverrunLeadsToMode{modes, 1, [&](const OverrunReport&) { ++calls; }};
  EXPECT_TRUE(is_of_user(handler));
  EXPECT_FALSE(is_of_user(OverrunLeadsToMode{modes, 1, {}}));
  EXPECT_FALSE(is_of_user({}));
  handler({});
  EXPECT_EQ(calls, 1);
  ManualClock clock;
  modes->follow(clock, [](std::size_t mode) { EXPECT_EQ(mode, 1u); });
  EXPECT_EQ(modes->in_force(), "degraded");
}

TEST(Modes, AComponentAsksForAnyOfThem) {
  Box box;
  box.world().in_callback = [&](const std::string& name) {
    if (name != "loop") return;
    const bool is_normal = box->mode() == "normal";
    EXPECT_TRUE(Robot::last->request_mode(is_normal ? "safe" : "normal"));
    EXPECT_FALSE(Robot::last->request_mode("fast"));
  };
  box.ran_in(15ms);
  EXPECT_EQ(box->mode(), "safe");
  box.ran_in(10ms);
  EXPECT_EQ(box->mode(), "normal");
  EXPECT_THAT(
      box.end().mode_switches,
      ElementsAre(testing::Field(&ProcessResult::ModeSwitch::cause, "a component asked for it"),
                  testing::Field(&ProcessResult::ModeSwitch::mode, "normal")));
}

TEST(Modes, AnUnknownModeIsAnErrorThatListsThem) {
  Box box;
  try {
    box->set_mode("degrade");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "no mode is called 'degrade'; did you mean 'degraded'? valid: "
                 "normal, degraded, safe");
  }
  EXPECT_EQ(box->mode(), "normal");
}

// The work of a coroutine that has begun ends: its remainder is demoted.
TEST(Modes, WhatACoroutineHasBegunEndsWhenItsCallbackIsDropped) {
  Box box("modes: {calm: {drop: [worker/work]}}\n",
          "    - {component: test::ModesWorker, name: worker, callbacks: {work: {priority: 9}}, "
          "callback_groups: {default: {priority: 9}}}\n");
  box.world().in_callback = [&](const std::string& name) {
    if (name == "first") {
      EXPECT_TRUE(Robot::last->request_mode("calm"));
    }
  };
  EXPECT_THAT(box.ran_in(19ms), ElementsAre("first@10", "loop@12", "plan@12", "log@12", "second@12",
                                            "third@14", "end@16"));
  EXPECT_THAT(box.ran_in(10ms), ElementsAre("loop@20", "plan@20", "log@20"));
}

TEST(Modes, ATimerThatIsMadeAgainIsServedAsTheModeInForceSays) {
  Box box;
  box->set_mode("safe");
  box.world().in_callback = [&](const std::string&) {
    if (box.world().ran.size() == 1) Robot::last->make_plan_again();
  };
  EXPECT_THAT(box.ran_in(35ms), ElementsAre("loop@10", "loop@20", "loop@30"));
  EXPECT_EQ(box.of(box.end(), "plan").dropped_by_mode, 2u);
}

TEST(Modes, AComponentThatIsLoadedIsServedAsTheModeInForceSays) {
  World real;
  world = &real;
  Container container(system_of(file_of(kModes)), {.clock = &real.clock});
  const ComponentDescription again = container.description().components.front();
  container.set_mode("safe");
  container.unload(container.components().front().id);
  container.load(again);
  const Robot& robot = *Robot::last;
  EXPECT_EQ(robot.callback_parameters(*robot.plan).serving, Serving::dropped);
  EXPECT_EQ(robot.callback_parameters(*robot.loop).serving, std::nullopt);
  world = nullptr;
}

TEST(Modes, TheNewestSwitchesAreKept) {
  Modes modes({{.name = "other"}});
  ManualClock clock;
  for (std::size_t i = 0; i < Modes::kMostSwitches + 2; ++i) {
    modes.want(i % 2 == 0 ? "other" : "normal");
    modes.follow(clock, [](std::size_t) {});
  }
  EXPECT_EQ(modes.switches().size(), Modes::kMostSwitches);
  EXPECT_EQ(modes.switches().back().cause, "it was asked for");
}

// ---- The service ----

TEST(Modes, TheServiceLeadsToAModeAndSaysWhatIsWrong) {
  World real;
  world = &real;
  SystemDescription system = system_of(file_of(kModes));
  Container container(system);
  const auto asking = std::make_shared<Node>("asking");
  const auto client = asking->create_client<SetMode>("/box/set_mode");
  const auto caller = executors().make("single_threaded", {.name = "caller"});
  caller->add_node(asking);
  container.start();
  const auto ask = [&](const std::string& mode) {
    const auto answer = client->async_send_request({mode});
    EXPECT_EQ(caller->spin_until_future_complete(answer, 30s), FutureReturnCode::SUCCESS);
    return answer.get();
  };
  EXPECT_TRUE(container.trace({.command = "start", .clock = "monotonic"}).success);
  EXPECT_TRUE(ask("safe")->success);
  EXPECT_EQ(container.mode(), "safe");
  const auto refused = ask("fast");
  EXPECT_FALSE(refused->success);
  EXPECT_THAT(refused->reason, HasSubstr("valid: normal, degraded, safe"));
  EXPECT_TRUE(ask("normal")->success);
  EXPECT_EQ(container.mode(), "normal");
  const auto traced = container.trace({.command = "stop"});
  ASSERT_EQ(traced.modes.size(), 2u);
  EXPECT_EQ(traced.modes[0].mode, "safe");
  EXPECT_LE(traced.modes[0].end_ns, traced.modes[1].begin_ns);
  container.hold();
  container.stop();
  world = nullptr;
}

// ---- Many switches ----

std::atomic<std::uint64_t> seen{0};
class Counting : public Node {
 public:
  explicit Counting(const NodeOptions& options) : Node("counting", options) {}

 private:
  const std::shared_ptr<CallbackGroup> group_ =
      create_callback_group("any", CallbackGroupType::Reentrant);
  const std::shared_ptr<Subscription<Image>> first_ =
      create_subscription<Image>("number", 100, [](const Image&) { ++seen; });
  const std::shared_ptr<Subscription<Image>> second_ = create_subscription<Image>(
      "other", 100, [](const Image&) { ++seen; }, group_);
};

TEST(Modes, ManySwitchesLoseNothing) {
  provide<Counting>("test::ModesCounting");
  constexpr int kSwitches = 10'000 / kFewerSanitized;
  struct Quiet {
    const LogLevel before = Logger::instance().level();
    Quiet() { Logger::instance().set_level(LogLevel::warn); }
    ~Quiet() { Logger::instance().set_level(before); }
  } const quiet;
  SystemDescription system = system_of(R"(
executors: {default: {type: events, scheduler: fixed_priority, threads: [a, b]}}
threads: {a: {}, b: {}}
modes:
  drops: {drop: [counting/number, counting/other]}
  demotes: {demote: [counting/number], drop: [counting/other]}
container: {name: box, components: [{component: test::ModesCounting, name: counting}]}
)");
  Container container(system);
  container.start();
  container.release();
  const auto sender = std::make_shared<Node>("sender");
  const auto number = sender->create_publisher<Image>("number", 100);
  const auto other = sender->create_publisher<Image>("other", 100);
  std::atomic<bool> is_over{false};
  std::uint64_t sent = 0;
  std::thread sends([&] {
    while (!is_over) {
      number->publish(Image{});
      other->publish(Image{});
      sent += 2;
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < kSwitches; ++i)
    container.set_mode(i % 3 == 0 ? "drops" : i % 3 == 1 ? "demotes" : "normal");
  is_over = true;
  sends.join();
  container.hold();
  container.stop();
  std::uint64_t expected = 0, served = 0, received = 0;
  for (const auto& callback : container.result().callbacks) {
    const CallbackStatistics& counted = callback.statistics;
    EXPECT_EQ(counted.lost(), 0u) << counted.callback;
    expected += counted.expected;
    received += counted.received;
    served += counted.received + counted.dropped + counted.dropped_by_mode;
  }
  EXPECT_EQ(expected, sent);
  EXPECT_EQ(served, sent);
  EXPECT_EQ(received, seen.load());
}

}  // namespace
}  // namespace takt::modes_test
