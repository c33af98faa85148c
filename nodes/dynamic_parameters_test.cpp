// Tests of parameters that may be undeclared, of several at once, and of the callbacks around
// setting.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <optional>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::ThrowsMessage;

const ParameterDescriptor kAnyType{.dynamic_typing = true};

// Why the values are refused; empty when they were set.
std::string reason(Node& node, const Parameters& values) {
  return node.set_parameters_atomically(values).reason;
}

std::string text(const Parameters& values) {
  std::string result;
  for (const auto& [name, value] : values) result += name + "=" + to_string(value) + " ";
  return result;
}

// ---- Any type ----

TEST(DynamicParameters, TakeValuesOfEveryType) {
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("any", ParameterValue(std::int64_t{1}), kAnyType);
  const std::vector<ParameterValue> values{true,
                                           std::int64_t{2},
                                           0.5,
                                           std::string("map"),
                                           std::vector<std::uint8_t>{1},
                                           std::vector<bool>{true},
                                           std::vector<std::int64_t>{1},
                                           std::vector<double>{1},
                                           std::vector<std::string>{"a"}};
  for (const ParameterValue& value : values) {
    EXPECT_EQ(reason(*node, {{"any", value}}), "");
    EXPECT_EQ(node->get_parameter<ParameterValue>("any"), value);
  }
  EXPECT_TRUE(node->describe_parameter("any").dynamic_typing);
  EXPECT_THAT([&] { node->get_parameter<int>("any"); },
              ThrowsMessage<Error>(HasSubstr("is a string array; it cannot be read as")));
}

TEST(DynamicParameters, KeepTheRangesOfTheirTypes) {
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("any", ParameterValue(std::string("auto")),
                          {.dynamic_typing = true,
                           .integer_range = IntegerRange{0, 9},
                           .floating_point_range = FloatingPointRange{0, 1}});
  EXPECT_EQ(reason(*node, {{"any", 10}}),
            "parameter 'any' of node 'camera' cannot be 10; give an integer from 0 to 9");
  EXPECT_EQ(reason(*node, {{"any", 1.5}}),
            "parameter 'any' of node 'camera' cannot be 1.5; give a floating-point number from 0 "
            "to 1");
  EXPECT_EQ(reason(*node, {{"any", 9}}), "");
  EXPECT_EQ(reason(*node, {{"any", std::string("off")}}), "");
}

TEST(DynamicParameters, MayBeDeclaredWithoutAValue) {
  const auto node = std::make_shared<Node>(
      "camera", NodeOptions{.parameters = {{"given", std::string("a value")}}});
  node->declare_parameter("any", ParameterValue(), kAnyType);
  EXPECT_EQ(node->get_parameter<ParameterValue>("any"), ParameterValue());
  EXPECT_THAT([&] { node->get_parameter<double>("any"); },
              ThrowsMessage<Error>("parameter 'any' of node 'camera' is not set; it cannot be read "
                                   "as a floating-point number"));
  EXPECT_EQ(node->declare_parameter("given", ParameterValue(), kAnyType),
            ParameterValue(std::string("a value")));
  EXPECT_THAT([&] { node->declare_parameter("fixed", ParameterValue()); },
              ThrowsMessage<Error>("parameter 'fixed' of node 'camera' is declared without a "
                                   "value; give one, which says its type, or dynamic_typing"));
}

TEST(GetParameterOr, GivesTheAlternativeForWhatIsNotSet) {
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("rate", 30);
  node->declare_parameter("any", ParameterValue(), kAnyType);
  EXPECT_EQ(node->get_parameter_or("rate", 1), 30);
  EXPECT_EQ(node->get_parameter_or("any", 0.5), 0.5);
  EXPECT_EQ(node->get_parameter_or("none", std::string("map")), "map");
  EXPECT_THROW(node->get_parameter_or("rate", true), Error);
}

// ---- Undeclaring ----

TEST(UndeclareParameter, TakesItAway) {
  const auto node =
      std::make_shared<Node>("camera", NodeOptions{.parameters = {{"any", std::int64_t{5}}}});
  std::vector<std::string> deleted;
  node->set_parameters_listener(
      [&](const ParameterChanges& changes) { deleted = changes.deleted; });
  node->declare_parameter("any", ParameterValue(true), kAnyType);
  node->undeclare_parameter("any");
  EXPECT_FALSE(node->has_parameter("any"));
  EXPECT_THAT(deleted, ElementsAre("any"));
  EXPECT_THAT(node->unused_parameters(), IsEmpty());  // it was declared
  EXPECT_EQ(node->declare_parameter("any", 1), 5);
}

TEST(UndeclareParameter, RefusesUnknownReadOnlyAndFixedOnes) {
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("rate", 30);
  node->declare_parameter("model", ParameterValue(std::string("x")),
                          {.read_only = true, .dynamic_typing = true});
  EXPECT_THAT([&] { node->undeclare_parameter("rat"); },
              ThrowsMessage<Error>(HasSubstr("no parameter 'rat'; did you mean 'rate'?")));
  EXPECT_THAT([&] { node->undeclare_parameter("rate"); },
              ThrowsMessage<Error>("parameter 'rate' of node 'camera' cannot be undeclared: its "
                                   "type is fixed; declare it with dynamic_typing"));
  EXPECT_THAT([&] { node->undeclare_parameter("model"); },
              ThrowsMessage<Error>("parameter 'model' of node 'camera' cannot be undeclared: it is "
                                   "read-only"));
}

TEST(UndeclareParameter, IsAlsoSettingNoValue) {
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("any", ParameterValue(true), kAnyType);
  node->declare_parameter("rate", 30);
  node->declare_parameter("empty", ParameterValue(), kAnyType);
  std::optional<ParameterChanges> reported;
  node->set_parameters_listener([&](const ParameterChanges& changes) { reported = changes; });
  std::string asked;
  const auto handle = node->add_on_set_parameters_callback([&](const Parameters& values) {
    asked = text(values);
    return SetParametersResult();
  });
  EXPECT_EQ(reason(*node, {{"rate", ParameterValue()}, {"any", false}}),
            "parameter 'rate' of node 'camera' cannot be undeclared: its type is fixed; declare it "
            "with dynamic_typing");
  EXPECT_FALSE(reported);
  EXPECT_EQ(reason(*node, {{"any", ParameterValue()}, {"empty", ParameterValue()}, {"rate", 60}}),
            "");
  EXPECT_EQ(asked, "any=not set empty=not set rate=60 ");
  EXPECT_FALSE(node->has_parameter("any"));
  EXPECT_TRUE(node->has_parameter("empty"));  // as rclcpp: it had no value to lose
  ASSERT_TRUE(reported);
  EXPECT_THAT(reported->deleted, ElementsAre("any"));
  EXPECT_EQ(text(reported->changed), "empty=not set rate=60 ");
}

// A reader gets the whole value or the error. Of two threads, one declares and one undeclares it.
TEST(UndeclareParameter, MayComeFromAnyThread) {
  const auto node = std::make_shared<Node>("camera");
  const ParameterValue value(std::string("a text that fits into no small string"));
  std::atomic<int> declared{0}, undeclared{0};
  int reported = 0;
  node->set_parameters_listener([&](const ParameterChanges& changes) {
    reported += static_cast<int>(changes.added.size()) - static_cast<int>(changes.deleted.size());
    EXPECT_TRUE(reported == 0 || reported == 1);
  });
  const auto attempt = [](std::atomic<int>& successes, const auto& change) {
    try {
      change();
      ++successes;
    } catch (const Error&) {
    }
  };
  std::atomic<bool> is_over{false};
  std::thread reader([&] {
    while (!is_over) {
      EXPECT_EQ(node->get_parameter_or("any", value), value);
      const Parameters all = node->get_parameters_by_prefix("");
      const auto found = all.find("any");
      EXPECT_TRUE(found == all.end() || found->second == value);
    }
  });
  std::vector<std::thread> writers;
  for (int writer = 0; writer < 2; ++writer) {
    writers.emplace_back([&] {
      for (int i = 0; i < 1000; ++i) {
        attempt(declared, [&] { node->declare_parameter("any", value, kAnyType); });
        attempt(undeclared, [&] { node->undeclare_parameter("any"); });
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  is_over = true;
  reader.join();
  EXPECT_GE(declared, 1000);
  EXPECT_EQ(declared - undeclared, reported);
}

// ---- Several at once ----

TEST(SeveralParameters, AreDeclaredUnderAName) {
  const auto node =
      std::make_shared<Node>("arm", NodeOptions{.parameters = {{"pid.d", std::int64_t{3}}}});
  EXPECT_THAT(node->declare_parameters("pid", std::map<std::string, double>{{"p", 1}, {"d", 2}}),
              ElementsAre(3, 1));
  EXPECT_EQ(node->get_parameter<double>("pid.p"), 1);
  using Described = std::pair<int, ParameterDescriptor>;
  EXPECT_THAT(
      node->declare_parameters(
          "", std::map<std::string, Described>{{"rate", {5, {.description = "of the loop"}}}}),
      ElementsAre(5));
  EXPECT_EQ(node->describe_parameter("rate").description, "of the loop");
}

TEST(SeveralParameters, AreReadTogether) {
  const auto node = std::make_shared<Node>("arm");
  node->declare_parameters("pid", std::map<std::string, double>{{"p", 1}, {"d", 2}});
  node->declare_parameter("pidx", 5, {.description = "other"});
  const std::vector<Parameter> parameters = node->get_parameters({"pidx", "pid.d"});
  ASSERT_EQ(parameters.size(), 2u);
  EXPECT_EQ(parameters[0].name, "pidx");
  EXPECT_EQ(parameters[0].value, ParameterValue(std::int64_t{5}));
  EXPECT_EQ(parameters[1].value, ParameterValue(2.0));
  EXPECT_EQ(text(node->get_parameters_by_prefix("pid")), "d=2 p=1 ");
  EXPECT_EQ(text(node->get_parameters_by_prefix("")), "pid.d=2 pid.p=1 pidx=5 use_sim_time=false ");
  EXPECT_THAT(node->get_parameters_by_prefix("pi"), IsEmpty());
  EXPECT_EQ(node->describe_parameters({"pid.p", "pidx"})[1].description, "other");
  EXPECT_THROW(node->get_parameters({"pidx", "none"}), Error);
  EXPECT_THROW(node->describe_parameters({"pidx", "none"}), Error);
}

TEST(SeveralParameters, HaveAResultEachWhenSetOneAfterAnother) {
  const auto node = std::make_shared<Node>("arm");
  node->declare_parameter("rate", 1);
  const std::vector<SetParametersResult> results =
      node->set_parameters({{"rate", 2}, {"none", 3}, {"rate", true}, {"rate", 4}});
  ASSERT_EQ(results.size(), 4u);
  EXPECT_TRUE(results[0].successful);
  EXPECT_THAT(results[1].reason, HasSubstr("no parameter 'none'"));
  EXPECT_THAT(results[2].reason, HasSubstr("cannot be true"));
  EXPECT_TRUE(results[3].successful);
  EXPECT_EQ(node->get_parameter<int>("rate"), 4);
}

// ---- Callbacks around setting ----

TEST(PreSetCallbacks, ChangeWhatIsSet) {
  const auto node = std::make_shared<Node>("arm");
  std::vector<std::string> trace;
  const auto clamp = node->add_pre_set_parameters_callback([&](Parameters& values) {
    trace.push_back("first " + text(values));
    values["half"] = std::get<double>(values.at("whole")) / 2;
  });
  const auto erase = node->add_pre_set_parameters_callback([&](Parameters& values) {
    trace.push_back("second " + text(values));
    values.erase("ignored");
  });
  node->declare_parameters("", std::map<std::string, double>{{"whole", 2}, {"half", 1}});
  EXPECT_THAT(trace, IsEmpty());  // as rclcpp: not when they are declared
  EXPECT_EQ(reason(*node, {{"whole", 5.0}, {"ignored", 1}}), "");
  EXPECT_THAT(trace, ElementsAre("second ignored=1 whole=5 ", "first whole=5 "));
  EXPECT_EQ(node->get_parameter<double>("half"), 2.5);
}

TEST(PreSetCallbacks, MayLeaveNothingOrWhatIsRefused) {
  const auto node = std::make_shared<Node>("arm");
  node->declare_parameter("rate", 1);
  auto handle = node->add_pre_set_parameters_callback([](Parameters& values) { values.clear(); });
  EXPECT_EQ(reason(*node, {{"rate", 2}}),
            "node 'arm': no parameter is given, or a callback has removed all");
  handle = node->add_pre_set_parameters_callback([](Parameters& values) { values["none"] = 1; });
  EXPECT_THAT(reason(*node, {{"rate", 2}}), HasSubstr("no parameter 'none'"));
  EXPECT_EQ(node->get_parameter<int>("rate"), 1);
  handle.reset();
  EXPECT_EQ(reason(*node, {{"rate", 2}}), "");
}

TEST(PostSetCallbacks, AreCalledAfterSuccessOnly) {
  const auto node = std::make_shared<Node>("arm");
  std::vector<std::string> trace;
  const auto note = [&](const std::string& who) {
    return [&, who](const Parameters& values) {
      for (const auto& [name, value] : values) {
        trace.push_back(
            who + name +
            (value == node->get_parameter<ParameterValue>(name) ? " has " : " will have ") +
            to_string(value));
      }
    };
  };
  const auto first = node->add_post_set_parameters_callback(note("1 "));
  auto second = node->add_post_set_parameters_callback(note("2 "));
  node->declare_parameter("gain", 0.5);
  EXPECT_EQ(reason(*node, {{"gain", 2}}), "");
  second.reset();
  EXPECT_NE(reason(*node, {{"gain", true}}), "");
  const auto refuse = node->add_on_set_parameters_callback([](const Parameters&) {
    return SetParametersResult{false, "no"};
  });
  EXPECT_EQ(reason(*node, {{"gain", 3}}), "no");
  EXPECT_THAT(trace,
              ElementsAre("2 gain has 0.5", "1 gain has 0.5", "2 gain has 2", "1 gain has 2"));
}

TEST(PostSetCallbacks, MayThrowAfterTheValueWasSetAndReported) {
  const auto node = std::make_shared<Node>("arm");
  node->declare_parameter("rate", 1);
  int reports = 0;
  node->set_parameters_listener([&](const ParameterChanges&) { ++reports; });
  auto handle = node->add_post_set_parameters_callback(
      [](const Parameters&) { throw std::runtime_error("oh"); });
  EXPECT_THROW(reason(*node, {{"rate", 2}}), std::runtime_error);
  EXPECT_EQ(node->get_parameter<int>("rate"), 2);
  EXPECT_EQ(reports, 1);
  handle.reset();
  EXPECT_EQ(reason(*node, {{"rate", 3}}), "");
}

TEST(ParameterCallbacks, MayNotChangeParametersThemselves) {
  const auto node = std::make_shared<Node>("arm");
  node->declare_parameter("rate", 1);
  node->declare_parameter("any", ParameterValue(true), kAnyType);
  int refused = 0;
  const auto change = [&] {
    EXPECT_THAT(
        [&] {
          reason(*node, {{"rate", 9}});
        },
        ThrowsMessage<Error>(HasSubstr("a callback of parameters sets one")));
    EXPECT_THAT([&] { node->undeclare_parameter("any"); },
                ThrowsMessage<Error>(HasSubstr("a callback of parameters undeclares one")));
    EXPECT_THROW(node->declare_parameter("new", 1), Error);
    ++refused;
  };
  const auto pre = node->add_pre_set_parameters_callback([&](Parameters&) { change(); });
  const auto post = node->add_post_set_parameters_callback([&](const Parameters&) { change(); });
  EXPECT_EQ(reason(*node, {{"rate", 2}}), "");
  EXPECT_EQ(refused, 2);
  EXPECT_EQ(node->get_parameter<int>("rate"), 2);
}

TEST(ParameterCallbacks, AreNotCalledAfterAnotherDroppedThem) {
  const auto node = std::make_shared<Node>("arm");
  node->declare_parameter("rate", 1);
  int calls = 0;
  auto first = node->add_post_set_parameters_callback([&](const Parameters&) { ++calls; });
  const auto second =
      node->add_post_set_parameters_callback([&](const Parameters&) { first.reset(); });
  EXPECT_EQ(reason(*node, {{"rate", 2}}), "");
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace takt
