// Tests of a node's parameters: declared, described, read and set.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <limits>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"
#include "takt/nodes/node.hpp"

namespace takt::node_parameters_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

std::shared_ptr<Node> make_node(const std::string& name, const NodeOptions& options = {}) {
  return std::make_shared<Node>(name, options);
}

// Why the values are refused; empty when they were set.
std::string reason(Node& node, const Parameters& values) {
  const SetParametersResult result = node.set_parameters_atomically(values);
  EXPECT_EQ(result.successful, result.reason.empty());
  return result.reason;
}

// ---- Declaring and reading ----

TEST(NodeParameters, HaveTheDeclaredValueWithoutConfiguration) {
  const auto node = make_node("camera");
  EXPECT_EQ(node->declare_parameter("rate", 30), 30);
  EXPECT_EQ(node->declare_parameter("gain", 0.5f), 0.5f);
  EXPECT_TRUE(node->declare_parameter("on", true));
  EXPECT_EQ(node->declare_parameter("frame", std::string("map")), "map");
  EXPECT_EQ(node->get_parameter<int>("rate"), 30);
  EXPECT_EQ(node->get_parameter<std::int64_t>("rate"), 30);
  EXPECT_EQ(node->get_parameter<double>("gain"), 0.5);
  EXPECT_TRUE(node->get_parameter<bool>("on"));
  EXPECT_EQ(node->get_parameter<std::string>("frame"), "map");
}

TEST(NodeParameters, HaveTheConfiguredValueIfThereIsOne) {
  const auto node =
      make_node("camera", {.parameters = {{"rate", std::int64_t{60}},
                                          {"frame", std::string("odom")},
                                          {"weights", std::vector<double>{0.5, 0.25}}}});
  EXPECT_EQ(node->declare_parameter("rate", 30), 60);
  EXPECT_EQ(node->declare_parameter("frame", std::string("map")), "odom");
  EXPECT_THAT(node->declare_parameter("weights", std::vector<double>{1.0}), ElementsAre(0.5, 0.25));
  EXPECT_EQ(node->get_parameter<int>("rate"), 60);
}

TEST(NodeParameters, TakeAnIntegerWhereAFloatingPointNumberIsDeclared) {
  const auto node = make_node("camera", {.parameters = {{"gain", std::int64_t{2}}}});
  EXPECT_EQ(node->declare_parameter("gain", 0.5), 2.0);
}

TEST(NodeParameters, RefuseAConfiguredValueOfAnotherType) {
  const auto node = make_node(
      "camera",
      {.parameters = {{"rate", std::string("fast")}, {"count", 2.5}, {"on", std::int64_t{1}}}});
  EXPECT_THAT(
      [&] { node->declare_parameter("rate", 30); },
      ThrowsMessage<Error>("parameter 'rate' of node 'camera' cannot be 'fast'; give an integer"));
  EXPECT_THAT([&] { node->declare_parameter("count", 2); },
              ThrowsMessage<Error>(HasSubstr("cannot be 2.5; give an integer")));
  EXPECT_THAT([&] { node->declare_parameter("on", true); },
              ThrowsMessage<Error>(HasSubstr("cannot be 1; give a boolean")));
}

TEST(NodeParameters, RefuseToBeReadAsAnotherType) {
  const auto node = make_node("camera");
  node->declare_parameter("names", std::vector<std::string>{"a"});
  EXPECT_THAT([&] { node->get_parameter<bool>("names"); },
              ThrowsMessage<Error>(HasSubstr("is a string array; it cannot be read as a boolean")));
}

TEST(NodeParameters, RefuseToBeReadUndeclaredAndSuggestTheNearest) {
  const auto node = make_node("camera", {.parameters = {{"rate", std::int64_t{60}}}});
  node->declare_parameter("gain", 0.5);
  EXPECT_THAT([&] { node->get_parameter<double>("gian"); },
              ThrowsMessage<Error>("node 'camera' has no parameter 'gian'; did you mean 'gain'? "
                                   "valid: gain, use_sim_time"));
  EXPECT_THAT([&] { node->get_parameter<int>("rate"); },  // configured is not declared
              ThrowsMessage<Error>(HasSubstr("node 'camera' has no parameter 'rate'")));
}

TEST(NodeParameters, RefuseToBeDeclaredTwice) {
  const auto node = make_node("camera");
  node->declare_parameter("rate", 30);
  EXPECT_THAT([&] { node->declare_parameter("rate", 30); },
              ThrowsMessage<Error>("parameter 'rate' of node 'camera' is declared twice"));
}

TEST(NodeParameters, AreListedWhenNobodyDeclaredThem) {
  const auto node =
      make_node("camera", {.parameters = {{"rate", std::int64_t{1}}, {"rat", std::int64_t{2}}}});
  EXPECT_THAT(node->unused_parameters(), ElementsAre("rat", "rate"));
  node->declare_parameter("rate", 30);
  EXPECT_THAT(node->unused_parameters(), ElementsAre("rat"));
}

TEST(NodeParameters, AreReadWithTheirTypeOrWithAny) {
  const auto node = make_node("camera");
  node->declare_parameter("rate", 30);
  EXPECT_EQ(node->get_parameter<ParameterValue>("rate"), ParameterValue(std::int64_t{30}));
  EXPECT_TRUE(node->has_parameter("rate"));
  EXPECT_FALSE(node->has_parameter("rat"));
}

TEST(NodeParameters, RefuseWhatTheIntegerOfTheCodeCannotHold) {
  const auto node = make_node("camera", {.parameters = {{"large", std::int64_t{5'000'000'000}},
                                                        {"negative", std::int64_t{-1}}}});
  EXPECT_THAT([&] { node->declare_parameter("large", 1); },
              ThrowsMessage<Error>("parameter 'large' of node 'camera' cannot be 5000000000; give "
                                   "an integer from -2147483648 to 2147483647"));
  EXPECT_THAT(
      [&] { node->declare_parameter("negative", 1U); },
      ThrowsMessage<Error>(HasSubstr("cannot be -1; give an integer from 0 to 4294967295")));
  EXPECT_EQ(node->declare_parameter("large", std::int64_t{1}), 5'000'000'000);
  EXPECT_THAT([&] { node->get_parameter<int>("large"); },
              ThrowsMessage<Error>("parameter 'large' of node 'camera' is 5000000000; read it as a "
                                   "wider integer"));
}

TEST(NodeParameters, AreReadWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto node = make_node("camera");
  node->declare_parameter("rate", 30, {.description = "a text that fits into no small string"});
  node->declare_parameter("gain", 0.5);
  const RealtimeScope scope;
  EXPECT_EQ(node->get_parameter<int>("rate"), 30);
  EXPECT_EQ(node->get_parameter<double>("gain"), 0.5);
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

TEST(NodeParameters, TakeAListOfIntegersForAByteArray) {
  using Bytes = std::vector<std::uint8_t>;
  using Integers = std::vector<std::int64_t>;
  const auto node = make_node(
      "camera", {.parameters = {{"header", Integers{0, 255}}, {"wrong", Integers{0, 256}}}});
  EXPECT_THAT(node->declare_parameter("header", Bytes{1}), ElementsAre(0, 255));
  EXPECT_THAT([&] { node->declare_parameter("wrong", Bytes{}); },
              ThrowsMessage<Error>("parameter 'wrong' of node 'camera' cannot be [0, 256]; give a "
                                   "byte array"));
  EXPECT_EQ(reason(*node, {{"header", Bytes{7}}}), "");
  EXPECT_EQ(node->get_parameter<Bytes>("header"), Bytes{7});
  EXPECT_NE(reason(*node, {{"header", Integers{-1}}}), "");
  node->declare_parameter("counts", Integers{1});
  EXPECT_NE(reason(*node, {{"counts", Bytes{1}}}), "");
}

TEST(NodeParameters, AlwaysHaveUseSimTime) {
  const auto node = make_node("camera");
  EXPECT_FALSE(node->get_parameter<bool>(kUseSimTime));
  EXPECT_EQ(reason(*node, {{kUseSimTime, true}}),
            "nothing sets the time of node 'camera'; give it a time source, or load it into a "
            "container that has `dds` or a thread called 'container'");
  EXPECT_EQ(reason(*node, {{kUseSimTime, false}}), "");
  EXPECT_FALSE(node->get_parameter<bool>(kUseSimTime));
  EXPECT_TRUE(
      make_node("camera", {.parameters = {{kUseSimTime, true}}})->get_parameter<bool>(kUseSimTime));
  EXPECT_THAT(
      [] {
        make_node("camera", {.parameters = {{kUseSimTime, std::int64_t{1}}}});
      },
      ThrowsMessage<Error>(HasSubstr("cannot be 1; give a boolean")));
}

// ---- Descriptors ----

TEST(ParameterDescriptors, AreKept) {
  const auto node = make_node("camera");
  node->declare_parameter("gain", 0.5,
                          {.description = "of the sensor",
                           .additional_constraints = "a power of two",
                           .read_only = true,
                           .floating_point_range = FloatingPointRange{0, 2, 0.25}});
  const ParameterDescriptor descriptor = node->describe_parameter("gain");
  EXPECT_EQ(descriptor.description, "of the sensor");
  EXPECT_EQ(descriptor.additional_constraints, "a power of two");
  EXPECT_TRUE(descriptor.read_only);
  EXPECT_EQ(descriptor.floating_point_range->step, 0.25);
  EXPECT_FALSE(descriptor.integer_range);
  EXPECT_THAT([&] { node->describe_parameter("gian"); },
              ThrowsMessage<Error>(HasSubstr("did you mean 'gain'?")));
}

TEST(ParameterDescriptors, RefuseConfiguredAndDefaultValuesOutOfTheRange) {
  const auto node = make_node(
      "camera",
      {.parameters = {{"rate", std::int64_t{200}}, {"gain", 3.0}, {"level", std::string("high")}}});
  EXPECT_THAT(
      [&] {
        node->declare_parameter("rate", 30, {.integer_range = IntegerRange{10, 60, 10}});
      },
      ThrowsMessage<Error>("parameter 'rate' of node 'camera' cannot be 200; give an "
                           "integer from 10 to 60 in steps of 10"));
  EXPECT_THAT(
      [&] {
        node->declare_parameter("gain", 1.0, {.floating_point_range = FloatingPointRange{0.5, 2}});
      },
      ThrowsMessage<Error>("parameter 'gain' of node 'camera' cannot be 3; give a floating-point "
                           "number from 0.5 to 2"));
  EXPECT_THAT(
      [&] {
        node->declare_parameter("level", 1, {.integer_range = IntegerRange{0, 9}});
      },
      ThrowsMessage<Error>(HasSubstr("cannot be 'high'; give an integer from 0 to 9")));
  EXPECT_THAT(
      [&] {
        node->declare_parameter("own", 10, {.integer_range = IntegerRange{0, 9}});
      },
      ThrowsMessage<Error>(HasSubstr("cannot be 10; give an integer from 0 to 9")));
  EXPECT_FALSE(node->has_parameter("rate"));  // what is refused is not declared
}

TEST(ParameterDescriptors, RefuseRangesThatAreNone) {
  const auto node = make_node("camera");
  EXPECT_THAT(
      [&] {
        node->declare_parameter("a", 1.0, {.integer_range = IntegerRange{0, 9}});
      },
      ThrowsMessage<Error>("parameter 'a' of node 'camera' is a floating-point number, and "
                           "its range is of another type; give the range of its type, or "
                           "none"));
  EXPECT_THAT(
      [&] {
        node->declare_parameter("a", 1, {.integer_range = IntegerRange{9, 0}});
      },
      ThrowsMessage<Error>(HasSubstr("cannot be in the range from 9 to 0; give the smaller")));
  EXPECT_THROW(
      node->declare_parameter("a", 1.0, {.floating_point_range = FloatingPointRange{0, 1, -0.1}}),
      Error);
}

TEST(ParameterDescriptors, AllowBothEndsAndWholeSteps) {
  const auto node = make_node("camera");
  node->declare_parameter("count", std::int64_t{-7}, {.integer_range = IntegerRange{-7, 10, 5}});
  for (const int count : {-7, -2, 3, 8, 10}) EXPECT_EQ(reason(*node, {{"count", count}}), "");
  for (const int count : {-8, -6, 0, 9, 11}) EXPECT_NE(reason(*node, {{"count", count}}), "");
  node->declare_parameter("gain", 0.0, {.floating_point_range = FloatingPointRange{0, 1, 0.1}});
  for (const double gain : {0.0, 0.1, 0.1 + 0.2, 0.7, 1.0}) {
    EXPECT_EQ(reason(*node, {{"gain", gain}}), "") << gain;
  }
  for (const double gain : {-0.1, 0.15, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_NE(reason(*node, {{"gain", gain}}), "") << gain;
  }
  constexpr auto kLowest = std::numeric_limits<std::int64_t>::min();
  constexpr auto kHighest = std::numeric_limits<std::int64_t>::max();
  node->declare_parameter("wide", std::int64_t{kLowest},
                          {.integer_range = IntegerRange{kLowest, kHighest, 2}});
  EXPECT_EQ(reason(*node, {{"wide", std::int64_t{0}}}), "");
  EXPECT_NE(reason(*node, {{"wide", std::int64_t{1}}}), "");
}

// ---- Listing ----

TEST(NodeParameters, AreListedByPrefixAndDepth) {
  const auto node = make_node("camera");
  for (const char* name : {"rate", "ratio", "a.x", "a.y", "a.b.x", "a.b.c.x", "ab.x"}) {
    node->declare_parameter(name, 1);
  }
  const auto names = [&](const std::vector<std::string>& prefixes, std::uint64_t depth) {
    return node->list_parameters(prefixes, depth).names;
  };
  EXPECT_THAT(names({}, 0), ElementsAre("a.b.c.x", "a.b.x", "a.x", "a.y", "ab.x", "rate", "ratio",
                                        "use_sim_time"));
  EXPECT_THAT(names({}, 1), ElementsAre("rate", "ratio", "use_sim_time"));
  EXPECT_THAT(names({}, 2), ElementsAre("a.x", "a.y", "ab.x", "rate", "ratio", "use_sim_time"));
  EXPECT_THAT(names({"a"}, 0), ElementsAre("a.b.c.x", "a.b.x", "a.x", "a.y"));
  EXPECT_THAT(names({"a"}, 1), ElementsAre("a.x", "a.y"));
  EXPECT_THAT(names({"a"}, 2), ElementsAre("a.b.x", "a.x", "a.y"));
  EXPECT_THAT(names({"a.b", "rate"}, 1), ElementsAre("a.b.x", "rate"));
  EXPECT_THAT(names({"rat"}, 0), IsEmpty());
  EXPECT_THAT(node->list_parameters().prefixes, ElementsAre("a.b.c", "a.b", "a", "ab"));
  EXPECT_THAT(node->list_parameters({"a"}, 1).prefixes, ElementsAre("a"));
}

// ---- Setting ----

TEST(SetParameters, ChangesValues) {
  const auto node = make_node("camera");
  node->declare_parameter("rate", 30);
  node->declare_parameter("gain", 0.5);
  node->declare_parameter("names", std::vector<std::string>{"a"});
  EXPECT_EQ(reason(*node, {{"rate", 60}, {"gain", 2}, {"names", std::vector<std::string>{}}}), "");
  EXPECT_EQ(node->get_parameter<int>("rate"), 60);
  EXPECT_EQ(node->get_parameter<double>("gain"), 2.0);  // from an integer
  EXPECT_THAT(node->get_parameter<std::vector<std::string>>("names"), IsEmpty());
}

TEST(SetParameters, RefusesUndeclaredNamesOtherTypesAndReadOnlyOnes) {
  const auto node = make_node("camera", {.parameters = {{"fixed", std::int64_t{2}}}});
  node->declare_parameter("rate", 30);
  EXPECT_EQ(node->declare_parameter("fixed", 1, {.read_only = true}), 2);
  EXPECT_EQ(reason(*node, {{"rat", 1}}),
            "node 'camera' has no parameter 'rat'; did you mean 'rate'? valid: fixed, rate, "
            "use_sim_time");
  EXPECT_EQ(reason(*node, {{"rate", 0.5}}),
            "parameter 'rate' of node 'camera' cannot be 0.5; give an integer");
  EXPECT_EQ(reason(*node, {{"rate", std::int64_t{5'000'000'000}}}),
            "parameter 'rate' of node 'camera' cannot be 5000000000; give an integer from "
            "-2147483648 to 2147483647");
  EXPECT_EQ(reason(*node, {{"fixed", 3}}),
            "parameter 'fixed' of node 'camera' is read-only; give its value in the configuration");
}

TEST(SetParameters, ChangesNothingWhenOneIsRefused) {
  const auto node = make_node("camera");
  node->declare_parameter("a", 1);
  node->declare_parameter("b", 1, {.integer_range = IntegerRange{0, 9}});
  EXPECT_NE(reason(*node, {{"a", 2}, {"b", 10}}), "");
  EXPECT_EQ(node->get_parameter<int>("a"), 1);
}

TEST(SetParameters, CallsCallbacksBeforehandTheLatestFirst) {
  const auto node = make_node("camera");
  node->declare_parameter("gain", 0.5);
  std::vector<std::string> trace;
  const auto note = [&](const std::string& who) {
    return [&, who](const Parameters& values) -> SetParametersResult {
      for (const auto& [name, value] : values) {
        trace.push_back(who + " " + name + " " + to_string(value) + " was " +
                        to_string(node->get_parameter<ParameterValue>(name)));
      }
      return {};
    };
  };
  const auto first = node->add_on_set_parameters_callback(note("first"));
  auto second = node->add_on_set_parameters_callback(note("second"));
  EXPECT_EQ(reason(*node, {{"gain", 1}}), "");
  second.reset();
  EXPECT_EQ(reason(*node, {{"gain", 2.5}}), "");
  EXPECT_THAT(trace,
              ElementsAre("second gain 1 was 0.5", "first gain 1 was 0.5", "first gain 2.5 was 1"));
}

TEST(SetParameters, MayBeRefusedByACallback) {
  const auto node = make_node("camera", {.parameters = {{"late", std::int64_t{13}}}});
  node->declare_parameter("a", 1);
  node->declare_parameter("b", 1);
  int calls = 0;
  const auto first = node->add_on_set_parameters_callback([&](const Parameters&) {
    ++calls;
    return SetParametersResult{};
  });
  const auto superstitious = node->add_on_set_parameters_callback([](const Parameters& values) {
    SetParametersResult result;
    for (const auto& [name, value] : values) {
      if (value == ParameterValue(std::int64_t{13})) result = {false, "13 brings bad luck"};
    }
    return result;
  });
  EXPECT_EQ(reason(*node, {{"a", 2}, {"b", 13}}), "13 brings bad luck");
  EXPECT_EQ(node->get_parameter<int>("a"), 1);
  EXPECT_EQ(calls, 0);
  EXPECT_THAT([&] { node->declare_parameter("late", 1); },
              ThrowsMessage<Error>("parameter 'late' of node 'camera' cannot be 13: 13 brings bad "
                                   "luck"));
  EXPECT_FALSE(node->has_parameter("late"));
}

TEST(SetParameters, IsRefusedInsideACallback) {
  const auto node = make_node("camera");
  node->declare_parameter("a", 1);
  const auto handle = node->add_on_set_parameters_callback([&](const Parameters&) {
    EXPECT_THAT(
        [&] {
          reason(*node, {{"a", 3}});
        },
        ThrowsMessage<Error>("node 'camera': a callback of parameters sets one; do it after the "
                             "callback"));
    EXPECT_THROW(node->declare_parameter("b", 1), Error);
    return SetParametersResult{};
  });
  EXPECT_EQ(reason(*node, {{"a", 2}}), "");
  EXPECT_EQ(node->get_parameter<int>("a"), 2);
}

TEST(SetParameters, GoesOnAfterACallbackThatThrew) {
  const auto node = make_node("camera");
  node->declare_parameter("a", 1);
  auto handle = node->add_on_set_parameters_callback(
      [](const Parameters&) -> SetParametersResult { throw std::runtime_error("oh"); });
  EXPECT_THROW(reason(*node, {{"a", 2}}), std::runtime_error);
  handle.reset();
  EXPECT_EQ(node->get_parameter<int>("a"), 1);
  EXPECT_EQ(reason(*node, {{"a", 2}}), "");
}

TEST(SetParameters, TogetherIsSeenWholeByReaders) {
  const auto node = make_node("camera");
  node->declare_parameter("name", std::string("none"));
  std::atomic<bool> is_over{false};
  std::thread reader([&] {
    while (!is_over) EXPECT_GE(node->get_parameter<std::string>("name").size(), 4u);
  });
  std::vector<std::thread> writers;
  for (const char letter : {'a', 'b'}) {
    writers.emplace_back([&, letter] {
      for (std::size_t i = 0; i < 500; ++i) {
        EXPECT_EQ(reason(*node, {{"name", std::string(4 + i, letter)}}), "");
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  is_over = true;
  reader.join();
}

}  // namespace
}  // namespace takt::node_parameters_test
