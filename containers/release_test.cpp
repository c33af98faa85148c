// What the release of a container does to timers, and what it finds out about names before.
// SPDX-License-Identifier: Apache-2.0
#include <future>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/container.hpp"
#include "takt/entities/task.hpp"
#include "takt/testing/eventually.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

struct Begin {
  int number = 0;
};
TAKT_MESSAGE(Begin, "test/msg/Begin", number);

/// Timers in every state that a constructor can leave them in.
class Timers : public Node {
 public:
  explicit Timers(const NodeOptions& options) : Node("timers", options) {
    last = this;
    cancelled->cancel();
    given->release_at(TimePoint(30min));
    taken_back->release_at(TimePoint(30min));
    taken_back->reset();
  }
  static inline Timers* last = nullptr;
  const std::function<void()> nothing = [] {};
  const std::shared_ptr<Timer> periodic = create_timer("periodic", 1h, nothing);
  const std::shared_ptr<Timer> cancelled = create_timer("cancelled", 1h, nothing);
  const std::shared_ptr<Timer> given = create_timer("given", 1h, nothing);
  const std::shared_ptr<Timer> taken_back = create_timer("taken_back", 1h, nothing);
};

/// Sleeps in a coroutine that a message begins.
class Sleeper : public Node {
 public:
  explicit Sleeper(const NodeOptions& options) : Node("sleeper", options) {
    begun = {}, awake = {};
    subscription_ = create_subscription<Begin>("begin", 1, [](const Begin&) -> Task<> {
      begun.set_value();
      co_await sleep_for(20ms);
      awake.set_value();
    });
  }
  static inline std::promise<void> begun, awake;

 private:
  std::shared_ptr<Subscription<Begin>> subscription_;
};

class TwoOfOneName : public Node {
 public:
  explicit TwoOfOneName(const NodeOptions& options) : Node("pair", options) {}

 private:
  const std::shared_ptr<Timer> first_ = create_timer("tick", 1h, [] {});
  const std::shared_ptr<Timer> second_ = create_timer("tick", 2h, [] {});
};

template <class Class>
std::string provide(const std::string& type) {
  components().add(
      type, {"for tests", [](const NodeOptions& options) {
               return std::make_unique<Component>(Component{std::make_shared<Class>(options)});
             }});
  return type;
}

SystemDescription of(std::initializer_list<std::string> types) {
  SystemDescription system;
  system.file = "test.yaml";
  int line = 2;
  for (const std::string& type : types) {
    system.components.push_back({.type = type, .where = fmt::format("test.yaml:{}", ++line)});
  }
  return system;
}

std::vector<std::string> errors_of(const SystemDescription& system) {
  try {
    const Container container(system);
    return {};
  } catch (const ConfigurationError& error) {
    return {error.errors().begin(), error.errors().end()};
  }
}

void expect_that_only_phases_begin(const Timers& timers, TimePoint now) {
  EXPECT_EQ(timers.periodic->next_release(), now + 1h);
  EXPECT_EQ(timers.taken_back->next_release(), now + 1h);
  EXPECT_TRUE(timers.cancelled->is_canceled());
  EXPECT_EQ(timers.given->next_release(), TimePoint(30min));
}

// The release called reset on every timer, so that one which its constructor had cancelled fired,
// and alarms that the library had set for itself were an hour away.
TEST(Release, BeginsThePhaseOfTimersAndRevivesNone) {
  static const std::string type = provide<Timers>("test::Timers");
  ManualClock clock;
  Container container(of({type}), {.clock = &clock});
  clock.advance(1s);
  container.release();
  expect_that_only_phases_begin(*Timers::last, TimePoint(1s));
}

TEST(Release, OfWhatIsLoadedLaterDoesTheSame) {
  static const std::string type = provide<Timers>("test::LoadedTimers");
  ManualClock clock;
  SystemDescription system = of({});
  system.executors.push_back({.name = "default"});
  Container container(system, {.clock = &clock});
  clock.advance(1s);
  container.load({.type = type});
  expect_that_only_phases_begin(*Timers::last, TimePoint(1s));
}

TEST(Release, LetsACoroutineWakeThatSleptBefore) {
  static const std::string type = provide<Sleeper>("test::Sleeper");
  Container container(of({type}));
  const auto beginner = std::make_shared<Node>("beginner");
  const auto publisher = beginner->create_publisher<Begin>("begin", 1);
  container.start();
  publisher->publish(Begin{});
  ASSERT_EQ(Sleeper::begun.get_future().wait_for(30s), std::future_status::ready);
  ASSERT_TRUE(eventually([&] { return container.pending() == 0; }));  // it sleeps now
  container.release();
  EXPECT_EQ(Sleeper::awake.get_future().wait_for(30s), std::future_status::ready);
  container.hold();
  container.stop();
}

TEST(Names, TwoTimersOfOneNameAreAnErrorOfTheFile) {
  static const std::string type = provide<TwoOfOneName>("test::TwoOfOneName");
  EXPECT_THAT(errors_of(of({type})),
              ElementsAre("test.yaml:3: component 'test::TwoOfOneName' makes two timers called "
                          "'tick'; give each its own name in the code"));
}

TEST(Names, TwoNodesThatTheCodeCallsTheSameAreAnErrorOfTheFile) {
  static const std::string type = provide<Sleeper>("test::Namesake");
  SystemDescription system = of({type, type, type});
  EXPECT_THAT(
      errors_of(system),
      ElementsAre(
          "test.yaml:4: the node of 'test::Namesake' is called '/sleeper', as that of "
          "'test::Namesake' in test.yaml:3; give each component its own name or namespace",
          "test.yaml:5: the node of 'test::Namesake' is called '/sleeper', as that of "
          "'test::Namesake' in test.yaml:3; give each component its own name or namespace"));
  system.components[1].name = "second";
  system.components[2].name_space = "/third";
  EXPECT_THAT(errors_of(system), ElementsAre());
}

}  // namespace
}  // namespace takt::test
