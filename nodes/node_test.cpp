// Tests of names, parameters and the ownership of entities.
// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/node.hpp"

#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/testing/eventually.hpp"

namespace takt::node_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

struct Scan {
  int id = 0;
};
TAKT_MESSAGE(Scan, "test_msgs/msg/Scan", id);

struct NamesService {
  using Request = Scan;
  using Response = Scan;
};

std::shared_ptr<Node> make_node(const std::string& name, const NodeOptions& options = {}) {
  return std::make_shared<Node>(name, options);
}

// Owns an entity as an executor does, and records its notifications.
class OwningSink final : public Sink {
 public:
  explicit OwningSink(std::shared_ptr<Entity> entity) : entity_(std::move(entity)) {
    const std::lock_guard lock(ownership_mutex());
    entity_->set_owner(this);
    entity_->attach(*this);
  }
  void announce(const Arrival&) noexcept override { trace.emplace_back("announce"); }
  void release_changed() noexcept override { trace.emplace_back("release changed"); }
  void expect_remove() noexcept override { trace.emplace_back("expect remove"); }
  void remove() noexcept override {
    trace.emplace_back("remove");
    entity_->detach();
    entity_.reset();
  }

  std::vector<std::string> trace;

 private:
  std::shared_ptr<Entity> entity_;
};

// ---- Names ----

/// What is logged while it lives.
class LogLines {
 public:
  LogLines() {
    Logger::instance().flush();  // nobody writes while the writer changes
    Logger::instance().set_writer([this](LogLevel, std::string_view line) {
      const std::lock_guard lock(mutex_);
      lines_.emplace_back(line);
    });
  }
  ~LogLines() {
    Logger::instance().flush();
    Logger::instance().set_writer({});
  }
  std::vector<std::string> get() const {
    Logger::instance().flush();
    const std::lock_guard lock(mutex_);
    return lines_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

TEST(Node, WarnsOnceOfTwoTimersOfOneName) {
  const LogLines log;
  const auto node = make_node("mapper");
  auto first = node->create_timer("tick", 1s, [] {});
  [[maybe_unused]] const auto clients = {node->create_client<NamesService>("a", {.timeout = 1s}),
                                         node->create_client<NamesService>("a", {.timeout = 1s})};
  first = nullptr;
  first = node->create_timer("tick", 1s, [] {});  // the only one again
  EXPECT_THAT(log.get(), IsEmpty());
  const auto second = node->create_timer("tick", 1s, [] {});
  const auto third = node->create_timer("tick", 1s, [] {});
  EXPECT_THAT(log.get(), ElementsAre(HasSubstr("/mapper: two timers are called 'tick'")));
  EXPECT_THAT(node->timers_of_one_name(), ElementsAre("tick"));
}

// Two subscriptions of one topic were one name for files, chains and results.
TEST(Node, NumbersSubscriptionsServicesAndClientsOfOneName) {
  const auto node = make_node("mapper");
  const auto subscribe = [&] {
    return node->create_subscription<std_msgs::msg::String>("in", 1,
                                                            [](const std_msgs::msg::String&) {});
  };
  auto first = subscribe();
  const auto second = subscribe();
  EXPECT_EQ(first->name(), "in");
  EXPECT_EQ(second->name(), "in#2");
  EXPECT_EQ(second->topic(), first->topic());
  EXPECT_EQ(node->find_entity("in#2"), second);
  first = nullptr;
  first = subscribe();
  EXPECT_EQ(first->name(), "in") << "the user holds no other";
  EXPECT_EQ(subscribe()->name(), "in#3");
  const auto client = node->create_client<NamesService>("a"),
             other = node->create_client<NamesService>("a");
  EXPECT_EQ(client->name(), "a");
  EXPECT_EQ(other->name(), "a#2");
}

TEST(Node, NumbersItsWallTimersWhichGoByRealTimeWhereItsClockIsSimulated) {
  ManualClock clock;
  SimulatedClock simulated(clock);
  const auto node = make_node("node", {.clock = &simulated});
  const Timer::SharedPtr first = node->create_wall_timer(10ms, [] {});
  const Timer::SharedPtr second = node->create_wall_timer(10ms, []() -> Task<> { co_return; });
  EXPECT_EQ(first->name(), "wall_timer_1");
  EXPECT_EQ(second->name(), "wall_timer_2");
  const auto simulated_timer = node->create_timer("tick", 10ms, [] {});
  EXPECT_EQ(first->next_release(), clock.now() + 10ms);
  EXPECT_EQ(second->next_release(), clock.now() + 10ms);
  EXPECT_NE(simulated_timer->next_release(), clock.now() + 10ms);
}

TEST(Node, WarnsOfTwoNodesOfOneName) {
  const LogLines log;
  {
    const auto first = make_node("namesake");
    const auto elsewhere = make_node("namesake", {.name_space = "/front"});
  }
  const auto again = make_node("namesake");
  EXPECT_THAT(log.get(), IsEmpty());
  const auto second = make_node("namesake");
  EXPECT_THAT(log.get(), ElementsAre(HasSubstr("/namesake: another node has this name too")));
}

TEST(Node, HasANameAndTheRootNamespaceByDefault) {
  const auto node = make_node("camera");
  EXPECT_EQ(node->name(), "camera");
  EXPECT_EQ(node->name_space(), "");
  EXPECT_EQ(node->fully_qualified_name(), "/camera");
  EXPECT_EQ(&node->clock(), &Clock::steady());
}

TEST(Node, TakesNameNamespaceAndClockFromTheOptions) {
  ManualClock clock;
  const auto node = make_node("camera", {.name = "left", .name_space = "/front", .clock = &clock});
  EXPECT_EQ(node->name(), "left");
  EXPECT_EQ(node->fully_qualified_name(), "/front/left");
  EXPECT_EQ(&node->clock(), &clock);
}

TEST(Node, MakesNamespacesAbsolute) {
  EXPECT_EQ(make_node("a", {.name_space = "front"})->name_space(), "/front");
  EXPECT_EQ(make_node("a", {.name_space = "/"})->name_space(), "");
  EXPECT_EQ(make_node("a", {.name_space = "/car/front"})->fully_qualified_name(), "/car/front/a");
}

TEST(Node, RefusesInvalidNamesAndNamespaces) {
  for (const char* name : {"", "left camera", "2nd", "a/b", "caf\xc3\xa9", "~", "a-b"}) {
    EXPECT_THAT([&] { make_node(name); },
                ThrowsMessage<Error>("'" + std::string(name) +
                                     "' cannot be the name of a node; use letters, digits and "
                                     "'_', not beginning with a digit"));
  }
  for (const char* name_space : {"/front/", "//front", "/2nd", "/a b", "/a//b"}) {
    EXPECT_THAT([&] { make_node("a", {.name_space = name_space}); },
                ThrowsMessage<Error>(HasSubstr("cannot be the name of a namespace")));
  }
}

TEST(Node, ResolvesRelativeAbsoluteAndPrivateTopics) {
  const auto node = make_node("camera", {.name_space = "/front"});
  EXPECT_EQ(node->resolve("image"), "/front/image");
  EXPECT_EQ(node->resolve("raw/image"), "/front/raw/image");
  EXPECT_EQ(node->resolve("/image"), "/image");
  EXPECT_EQ(node->resolve("~/image"), "/front/camera/image");
  EXPECT_EQ(make_node("camera")->resolve("image"), "/image");
  EXPECT_EQ(make_node("camera")->resolve("~/image"), "/camera/image");
}

TEST(Node, RefusesInvalidTopics) {
  const auto node = make_node("camera");
  for (const char* topic :
       {"", "/", "~", "~/", "/image/", "a//b", "2d", "/a/2d", "a b", "~image"}) {
    EXPECT_THAT([&] { node->resolve(topic); },
                ThrowsMessage<Error>(HasSubstr("cannot be the name of a topic")))
        << topic;
  }
}

TEST(Node, RemapsTopicsAndThenResolvesThem) {
  const auto node = make_node(
      "camera",
      {.name_space = "/front", .remap = {{"image", "picture"}, {"~/a", "/b"}, {"c", "~/d"}}});
  EXPECT_EQ(node->resolve("image"), "/front/picture");
  EXPECT_EQ(node->resolve("~/a"), "/b");
  EXPECT_EQ(node->resolve("c"), "/front/camera/d");
  EXPECT_EQ(node->resolve("picture"), "/front/picture");
}

TEST(Node, RemapsANameHoweverItIsWritten) {
  const auto node = make_node(
      "camera", {.name_space = "/front", .remap = {{"/front/image", "picture"}, {"scan", "/s"}}});
  EXPECT_EQ(node->resolve("image"), "/front/picture");
  EXPECT_EQ(node->resolve("/front/scan"), "/s");
  EXPECT_EQ(node->resolve("/scan"), "/scan");
  EXPECT_THAT(node->unused_remaps(), IsEmpty());
}

TEST(Node, RefusesARemapToAnInvalidTopic) {
  const auto node = make_node("camera", {.remap = {{"image", "my picture"}}});
  EXPECT_THAT([&] { node->resolve("image"); },
              ThrowsMessage<Error>(HasSubstr("'/my picture' cannot be the name of a topic")));
}

TEST(Node, ListsRemapsThatNobodyUsed) {
  const auto node = make_node("camera", {.remap = {{"image", "a"}, {"imgae", "b"}, {"scan", "c"}}});
  EXPECT_THAT(node->unused_remaps(), ElementsAre("image", "imgae", "scan"));
  node->resolve("image");
  const auto scans = node->create_publisher<Scan>("scan", 10);
  EXPECT_EQ(scans->topic(), "/c");
  EXPECT_THAT(node->unused_remaps(), ElementsAre("imgae"));
}

TEST(Node, RefusesInvalidNamesOfTimersGuardConditionsAndGroups) {
  const auto node = make_node("camera");
  EXPECT_THAT([&] { (void)node->create_timer("2", 1ms, [] {}); },
              ThrowsMessage<Error>(HasSubstr("'2' cannot be the name of a timer")));
  EXPECT_THAT([&] { (void)node->create_guard_condition("a b"); },
              ThrowsMessage<Error>(HasSubstr("'a b' cannot be the name of a guard condition")));
  EXPECT_THAT([&] { (void)node->create_callback_group("", CallbackGroupType::Reentrant); },
              ThrowsMessage<Error>(HasSubstr("'' cannot be the name of a callback group")));
}

// ---- Groups ----

TEST(NodeGroups, BeginWithADefaultGroupThatIsExclusive) {
  const auto node = make_node("camera");
  EXPECT_EQ(node->default_callback_group()->name(), "default");
  EXPECT_EQ(node->default_callback_group()->type(), CallbackGroupType::MutuallyExclusive);
  EXPECT_THAT(node->groups(), ElementsAre(node->default_callback_group()));
}

TEST(NodeGroups, LiveAsLongAsTheUserHoldsThem) {
  const auto node = make_node("camera");
  auto group = node->create_callback_group("io", CallbackGroupType::Reentrant, false);
  EXPECT_EQ(group->name(), "io");
  EXPECT_FALSE(group->automatically_add_to_executor());
  EXPECT_THAT(node->groups(), ElementsAre(node->default_callback_group(), group));
  EXPECT_THAT([&] { (void)node->create_callback_group("io", CallbackGroupType::Reentrant); },
              ThrowsMessage<Error>(HasSubstr("node 'camera' has two callback groups called 'io'")));
  group.reset();
  EXPECT_THAT(node->groups(), ElementsAre(node->default_callback_group()));
  EXPECT_NO_THROW((void)node->create_callback_group("io", CallbackGroupType::Reentrant));
}

TEST(NodeGroups, TakeOnlyEntitiesOfTheirNode) {
  const auto node = make_node("camera"), other = make_node("other");
  const auto group = node->create_callback_group("io", CallbackGroupType::Reentrant);
  const auto timer = node->create_timer(
      "tick", 1ms, [] {}, group);
  EXPECT_EQ(timer->group(), group);
  EXPECT_THAT(
      [&] {
        (void)other->create_timer(
            "tick", 1ms, [] {}, group);
      },
      ThrowsMessage<Error>(HasSubstr("'tick' of node 'other' was given a callback group of "
                                     "another node")));
  EXPECT_THROW((void)other->create_subscription<Scan>(
                   "scan", 1, [](const Scan&) {}, group),
               Error);
  EXPECT_THAT(other->entities(), IsEmpty());
}

// ---- Entities ----

TEST(NodeEntities, AreThoseThatTheUserHolds) {
  const auto node = make_node("camera");
  auto timer = node->create_timer("tick", 1ms, [] {});
  auto scans = node->create_subscription<Scan>("scan", 1, [](const Scan&) {});
  auto guard = node->create_guard_condition("stop");
  const auto names = [&] {
    std::vector<std::string> result;
    for (const auto& entity : node->entities()) result.push_back(entity->name());
    return result;
  };
  EXPECT_THAT(names(), ElementsAre("tick", "scan", "stop"));
  scans.reset();
  EXPECT_THAT(names(), ElementsAre("tick", "stop"));
  timer.reset();
  guard.reset();
  EXPECT_THAT(names(), IsEmpty());
}

TEST(NodeEntities, RetireWhenTheLastHandleIsDropped) {
  const auto node = make_node("camera");
  auto guard = node->create_guard_condition("stop");
  auto same = guard;
  OwningSink sink(node->entities().at(0));
  guard->trigger();
  guard.reset();
  EXPECT_THAT(sink.trace, ElementsAre("announce"));
  same.reset();
  EXPECT_THAT(sink.trace, ElementsAre("announce", "expect remove", "remove"));
  EXPECT_THAT(node->entities(), IsEmpty());
}

TEST(NodeEntities, LeaveTheirTopicBeforeTheyRetire) {
  const auto node = make_node("camera");
  const auto scans = node->create_publisher<Scan>("scan", 10);
  auto subscription = node->create_subscription<Scan>("scan", 10, [](const Scan&) {});
  OwningSink sink(node->entities().at(0));
  subscription.reset();
  scans->publish(Scan{});
  EXPECT_THAT(sink.trace, ElementsAre("expect remove", "remove"));
  EXPECT_EQ(scans->subscription_count(), 0u);
}

TEST(NodeEntities, RetireWithoutAnOwnerToo) {
  const auto node = make_node("camera");
  auto timer = node->create_timer("tick", 1ms, [] {});
  const std::weak_ptr<Entity> watched = node->entities().at(0);
  timer.reset();
  EXPECT_TRUE(watched.expired());
}

TEST(NodeEntities, OutliveTheirNodeInTheHandsOfTheUser) {
  ManualClock clock;
  auto node = make_node("camera", {.clock = &clock});
  int calls = 0;
  const auto timer = node->create_timer("tick", 1ms, [&] { ++calls; });
  node.reset();
  clock.advance(1ms);
  Slot slot;
  ASSERT_TRUE(timer->take(slot));
  timer->execute(slot);
  EXPECT_EQ(calls, 1);
}

// ---- Listeners ----

class NotingListener final : public NodeListener {
 public:
  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override {
    trace.push_back(node.name() + " entity " + entity->name());
  }
  void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) override {
    trace.push_back(node.name() + " group " + group->name());
  }
  void parameters_changed(Node& node) override { trace.push_back(node.name() + " parameters"); }
  std::vector<std::string> trace;
};

TEST(NodeListeners, GetWhatIsAddedWhileTheyListen) {
  const auto node = make_node("camera");
  NotingListener listener;
  const auto early = node->create_timer("early", 1ms, [] {});
  node->add_listener(listener);
  node->add_listener(listener);  // again: nothing changes
  const auto group = node->create_callback_group("io", CallbackGroupType::Reentrant);
  const auto timer = node->create_timer(
      "tick", 1ms, [] {}, group);
  const auto scans = node->create_subscription<Scan>("scan", 1, [](const Scan&) {});
  node->remove_listener(listener);
  const auto late = node->create_guard_condition("late");
  EXPECT_THAT(listener.trace,
              ElementsAre("camera group io", "camera entity tick", "camera entity scan"));
}

TEST(NodeListeners, OwnANodeOneAtATime) {
  const auto node = make_node("camera");
  NotingListener first, second;
  EXPECT_TRUE(node->claim(&first));
  EXPECT_TRUE(node->belongs_to(&first));
  EXPECT_FALSE(node->claim(&second));
  node->release(&second);  // not its to release
  EXPECT_TRUE(node->belongs_to(&first));
  node->release(&first);
  EXPECT_TRUE(node->claim(&second));
}

/// Removes another one in its call, when both are called.
class RemovingListener final : public NodeListener {
 public:
  RemovingListener(Node& of, std::atomic<int>& in) : of_(of), in_(in) {}
  void entity_added(Node&, const std::shared_ptr<Entity>&) override {
    in_.fetch_add(1);
    in_.notify_all();
    for (int now; (now = in_.load()) < 2;) in_.wait(now);
    of_.remove_listener(*other);
  }
  void group_added(Node&, const std::shared_ptr<CallbackGroup>&) override {}
  void parameters_changed(Node&) override {}

  NodeListener* other = nullptr;

 private:
  Node& of_;
  std::atomic<int>& in_;
};

// Each waited for the end of the other's call.
TEST(NodeListeners, ThatRemoveEachOtherDoNotWaitForEver) {
  const auto one = make_node("one"), two = make_node("two");
  std::atomic<int> in{0}, added{0};
  RemovingListener of_one(*two, in), of_two(*one, in);
  of_one.other = &of_two;
  of_two.other = &of_one;
  one->add_listener(of_one);
  two->add_listener(of_two);
  const auto add_to = [&](Node& node) {
    const auto guard = node.create_guard_condition("guard");
    added.fetch_add(1);
  };
  std::thread first([&] { add_to(*one); });
  std::thread second([&] { add_to(*two); });
  if (!eventually([&] { return added.load() == 2; })) std::abort();
  first.join();
  second.join();
}

/// An executor that takes entities, or one that refuses them.
class TakingListener final : public NodeListener {
 public:
  explicit TakingListener(bool refuses) : refuses_(refuses) {}
  void entity_added(Node&, const std::shared_ptr<Entity>& entity) override {
    if (refuses_) throw Error("refused");
    sink.emplace(entity);
  }
  void group_added(Node&, const std::shared_ptr<CallbackGroup>&) override {}
  void parameters_changed(Node&) override {}

  std::optional<OwningSink> sink;

 private:
  const bool refuses_;
};

// An entity that a second executor refuses stayed with the first one, which kept its callback.
TEST(Node, TakesAnEntityBackThatOneOfItsExecutorsRefuses) {
  const auto node = make_node("node");
  TakingListener first(false), second(true);
  node->add_listener(first);
  node->add_listener(second);
  const auto owned = std::make_shared<int>(1);
  EXPECT_THROW((void)node->create_guard_condition("guard", [owned] {}), Error);
  EXPECT_THAT(first.sink->trace, ElementsAre("expect remove", "remove"));
  EXPECT_EQ(owned.use_count(), 1);
  EXPECT_THAT(node->entities(), IsEmpty());
  node->remove_listener(first);
  node->remove_listener(second);
}

}  // namespace
}  // namespace takt::node_test
