// Tests of parameter callbacks with several threads: they run without a lock.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <functional>
#include <future>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/nodes/node.hpp"
#include "takt/testing/eventually.hpp"

namespace takt::parameter_callbacks_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::shared_ptr<Node> make_node(const std::string& name) {
  auto node = std::make_shared<Node>(name);
  node->declare_parameters("", std::map<std::string, int>{{"a", 0}, {"b", 0}});
  return node;
}

std::string reason(Node& node, const Parameters& values) {
  return node.set_parameters_atomically(values).reason;
}

int value(const Parameters& values, const std::string& name) {
  return static_cast<int>(std::get<std::int64_t>(values.at(name)));
}

// Runs what another thread does, to its end.
void elsewhere(const std::function<void()>& work) {
  std::thread(work).join();
}

// A lock was held while callbacks ran: this one waited for the thread that waited for it.
TEST(ParameterCallbacks, MayWaitForAThreadThatChangesTheSameNode) {
  const auto node = make_node("arm");
  const auto post = node->add_post_set_parameters_callback([&](const Parameters& values) {
    if (!values.contains("a")) return;
    elsewhere([&] { node->declare_parameter("late", 1); });
    elsewhere([&] { node->set_parameters_listener({}); });
  });
  EXPECT_EQ(reason(*node, {{"a", 1}}), "");
  EXPECT_TRUE(node->has_parameter("late"));
}

// Two nodes that mirror a parameter waited for each other's lock for ever.
TEST(ParameterCallbacks, OfTwoNodesMaySetEachOthersParameters) {
  const auto arm = make_node("arm"), leg = make_node("leg");
  const auto mirror = [](Node& from, Node& to) {
    return from.add_post_set_parameters_callback([&](const Parameters& values) {
      if (!values.contains("a")) return;
      static_cast<void>(reason(to, {{"b", values.at("a")}}));  // too many may wait
    });
  };
  const auto first = mirror(*arm, *leg), second = mirror(*leg, *arm);
  const auto set = [](Node& node) {
    for (int i = 1; i <= 2000; ++i) static_cast<void>(reason(node, {{"a", i}}));
  };
  std::thread one([&] { set(*arm); });
  set(*leg);
  one.join();
}

// Whichever thread calls it: here the one that is in a callback of the one node calls one of the
// other for a third thread, which comes from no callback.
TEST(ParameterCallbacks, MaySetANodeUnlessOneOfThatNodeHasLedToThem) {
  const auto arm = make_node("arm"), leg = make_node("leg");
  std::vector<std::string> trace;
  const auto of_arm = arm->add_post_set_parameters_callback([&](const Parameters& values) {
    trace.push_back("arm " + values.begin()->first);
    if (values.contains("a")) {
      // Left to this thread, and called from leg's callback.
      elsewhere([&] { EXPECT_EQ(reason(*arm, {{"b", 1}}), ""); });
      EXPECT_THROW(reason(*leg, {{"b", 1}}), Error);
    } else {
      EXPECT_EQ(reason(*leg, {{"b", 1}}), "");
    }
  });
  const auto of_leg = leg->add_post_set_parameters_callback([&](const Parameters& values) {
    trace.push_back("leg " + values.begin()->first);
    if (!values.contains("a")) return;
    EXPECT_EQ(reason(*arm, {{"a", 1}}), "");
  });
  EXPECT_EQ(reason(*leg, {{"a", 1}}), "");
  EXPECT_THAT(trace, ElementsAre("leg a", "arm a", "arm b", "leg b"));
}

// On-set callbacks that wait for each other's nodes hung as well.
TEST(OnSetCallbacks, RunAtTheSameTimeOnSeveralThreads) {
  const auto node = make_node("arm");
  std::atomic<int> inside{0};
  const auto on = node->add_on_set_parameters_callback([&](const Parameters&) {
    ++inside;
    EXPECT_TRUE(eventually([&] { return inside >= 2; }));
    return SetParametersResult();
  });
  std::thread other([&] { EXPECT_EQ(reason(*node, {{"b", 1}}), ""); });
  EXPECT_EQ(reason(*node, {{"a", 1}}), "");
  other.join();
}

TEST(OnSetCallbacks, CheckAgainWhatAnotherThreadHasOvertaken) {
  const auto node = make_node("arm");
  bool is_first = true;
  std::vector<int> seen;
  const auto on = node->add_on_set_parameters_callback([&](const Parameters& values) {
    if (!values.contains("a")) return SetParametersResult();
    seen.push_back(node->get_parameter<int>("b"));
    if (std::exchange(is_first, false))
      elsewhere([&] { EXPECT_EQ(reason(*node, {{"b", 5}}), ""); });
    return value(values, "a") >= node->get_parameter<int>("b")
               ? SetParametersResult()
               : SetParametersResult{false, "a is less than b"};
  });
  EXPECT_EQ(reason(*node, {{"a", 7}}), "");
  EXPECT_THAT(seen, ElementsAre(0, 5));
  is_first = true;
  EXPECT_EQ(reason(*node, {{"a", 4}}), "a is less than b");
}

TEST(OnSetCallbacks, CheckTenTimesAtTheMost) {
  const auto node = make_node("arm");
  int calls = 0;
  const auto on = node->add_on_set_parameters_callback([&](const Parameters& values) {
    if (values.contains("b")) return SetParametersResult();
    elsewhere([&] { EXPECT_EQ(reason(*node, {{"b", ++calls}}), ""); });
    return SetParametersResult();
  });
  EXPECT_EQ(
      reason(*node, {{"a", 1}}),
      "node 'arm': other threads have changed its parameters 10 times while callbacks checked "
      "the values");
  EXPECT_EQ(calls, 10);
  EXPECT_EQ(node->get_parameter<int>("a"), 0);
  EXPECT_THROW(node->declare_parameter("c", 1), Error);
}

// What another thread changes meanwhile is left to the one that calls post-set callbacks.
TEST(PostSetCallbacks, AreCalledInTheOrderOfTheChanges) {
  const auto node = make_node("arm");
  std::vector<std::string> trace;
  const auto here = std::this_thread::get_id();
  const auto post = node->add_post_set_parameters_callback([&](const Parameters& values) {
    for (const auto& [name, value] : values) trace.push_back(name + " " + to_string(value));
    EXPECT_EQ(std::this_thread::get_id(), here);
    if (value(values, "a") < 3) {
      elsewhere([&] { EXPECT_EQ(reason(*node, {{"a", value(values, "a") + 1}}), ""); });
      trace.emplace_back("set");
    }
  });
  EXPECT_EQ(reason(*node, {{"a", 1}}), "");
  EXPECT_THAT(trace, ElementsAre("a 1", "set", "a 2", "set", "a 3"));
}

TEST(PostSetCallbacks, SeeEveryChangeOfSeveralThreadsOnceAndInOrder) {
  const auto node = make_node("arm");
  std::vector<int> reported, called;  // neither is called on two threads at a time
  node->set_parameters_listener(
      [&](const ParameterChanges& changes) { reported.push_back(value(changes.changed, "a")); });
  const auto post = node->add_post_set_parameters_callback(
      [&](const Parameters& values) { called.push_back(value(values, "a")); });
  std::atomic<int> refused{0};
  std::vector<std::thread> writers;
  for (int writer = 0; writer < 3; ++writer) {
    writers.emplace_back([&, writer] {
      for (int i = 0; i < 300; ++i) {
        if (!reason(*node, {{"a", writer * 1000 + i}}).empty()) ++refused;  // too many wait
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(reported, called);
  EXPECT_EQ(called.size(), 900u - refused);
}

TEST(PostSetCallbacks, ThatDoNotReturnLetAThousandChangesWait) {
  const auto node = make_node("arm");
  std::vector<std::string> reasons;
  int calls = 0;
  const auto post = node->add_post_set_parameters_callback([&](const Parameters&) {
    if (++calls > 1) return;
    elsewhere([&] {
      for (int i = 1; i <= 1002; ++i) reasons.push_back(reason(*node, {{"a", i}}));
    });
  });
  EXPECT_EQ(reason(*node, {{"b", 1}}), "");
  EXPECT_THAT(std::vector(reasons.begin(), reasons.begin() + 1000), testing::Each(IsEmpty()));
  EXPECT_THAT(reasons.back(), HasSubstr("1000 changes wait"));
  EXPECT_EQ(node->get_parameter<int>("a"), 1000);
  EXPECT_EQ(calls, 1001);
}

TEST(PostSetCallbacks, OfOthersAreCalledWhenOneThrows) {
  const auto node = make_node("arm");
  int calls = 0;
  const auto counts = node->add_post_set_parameters_callback([&](const Parameters&) { ++calls; });
  const auto throws = node->add_post_set_parameters_callback([&](const Parameters& values) {
    if (!values.contains("a")) return;
    elsewhere([&] { EXPECT_EQ(reason(*node, {{"b", 1}}), ""); });
    throw std::runtime_error("oh");
  });
  EXPECT_THROW(reason(*node, {{"a", 1}}), std::runtime_error);
  EXPECT_EQ(calls, 2);
}

// A callback that owned its node's last user was called, and destroyed, with the lock held.
TEST(ParameterCallbacks, MayDropTheirHandleAndWhatTheyOwn) {
  const auto node = make_node("arm");
  PostSetParametersHandle handle;
  auto owned = std::shared_ptr<int>(new int, [&](int* owned_value) {
    delete owned_value;
    elsewhere([&] { EXPECT_EQ(reason(*node, {{"b", 1}}), ""); });
  });
  handle = node->add_post_set_parameters_callback(
      [&, owned = std::move(owned)](const Parameters&) { handle.reset(); });
  EXPECT_EQ(reason(*node, {{"a", 1}}), "");
  EXPECT_EQ(node->get_parameter<int>("b"), 1);
}

}  // namespace
}  // namespace takt::parameter_callbacks_test
