// Tests of ROS 2's parameter services, by clients in the same process.
// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/parameter_services.hpp"

#include <atomic>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/entries.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_type.hpp"

namespace takt {
namespace {

namespace wire = rcl_interfaces::msg;
namespace services = rcl_interfaces::srv;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;
using wire::ParameterType;

// One value of each type.
Parameters all_types() {
  return {{"a_boolean", true},
          {"b_integer", std::int64_t{-7}},
          {"c_number", 0.5},
          {"d_string", std::string("map")},
          {"dd_bytes", std::vector<std::uint8_t>{0, 255}},
          {"e_booleans", std::vector<bool>{true, false}},
          {"f_integers", std::vector<std::int64_t>{1, 2}},
          {"g_numbers", std::vector<double>{0.5, 0.25}},
          {"h_strings", std::vector<std::string>{"a", "b"}}};
}

/// A request for these parameters.
template <class Service>
typename Service::Request about(const std::vector<std::string>& names) {
  return typename Service::Request().set__names(names);
}

services::SetParameters::Request to_set(
    const std::vector<std::pair<std::string, wire::ParameterValue>>& values) {
  services::SetParameters::Request request;
  for (const auto& [name, value] : values) {
    request.parameters.push_back(wire::Parameter().set__name(name).set__value(value));
  }
  return request;
}

std::vector<std::string> names_of(const Parameters& parameters) {
  std::vector<std::string> names;
  for (const auto& [name, value] : parameters) names.push_back(name);
  return names;
}

TEST(ParameterMessages, AreTheValuesOnTheWire) {
  for (const auto& [name, value] : all_types()) {
    EXPECT_EQ(from_message(to_message(value)), value) << name;
  }
  EXPECT_EQ(to_message(true).type, ParameterType::PARAMETER_BOOL);
  EXPECT_EQ(to_message(0.5).double_value, 0.5);
  EXPECT_EQ(to_message({}).type, ParameterType::PARAMETER_NOT_SET);
  EXPECT_EQ(from_message({}), ParameterValue());
}

TEST(ParameterMessages, OfAnUnknownTypeAreErrors) {
  EXPECT_THAT([] { from_message(wire::ParameterValue().set__type(200)); },
              ThrowsMessage<Error>(HasSubstr("unknown type 200")));
}

class ParameterServicesTest : public testing::Test {
 protected:
  ParameterServicesTest() {
    for (const auto& [name, value] : all_types()) node_->declare_parameter(name, value);
    node_->declare_parameter("loop.gain", 1.0,
                             {.description = "of the loop",
                              .additional_constraints = "even halves",
                              .floating_point_range = FloatingPointRange{0, 2, 0.5}});
    node_->declare_parameter("loop.count", 3,
                             {.read_only = true, .integer_range = IntegerRange{1, 9, 2}});
  }

  // Calls as an executor of the host and of the caller would have it.
  template <class S>
  typename S::Response call(const std::string& service, const typename S::Request& request) {
    const auto client = caller_->create_client<S>("/front/camera/" + service);
    EXPECT_TRUE(client->service_is_ready());
    const auto future = client->async_send_request(request);
    const std::vector<std::shared_ptr<Entity>> served = host_->entities();
    for (const auto& entity : served) serve(*entity);
    serve(*client);
    return future.get().value();
  }

  const std::shared_ptr<Node> node_ =
      std::make_shared<Node>("camera", NodeOptions{.name_space = "/front"});
  const std::shared_ptr<Node> host_ = std::make_shared<Node>("host");
  const std::shared_ptr<Node> caller_ = std::make_shared<Node>("caller");
  const ParameterServices services_{*node_, *host_};

  static void serve(Entity& entity) {
    Slot slot;
    if (entity.take(slot)) entity.execute(slot);
  }
};

TEST_F(ParameterServicesTest, AreEntitiesOfTheirHost) {
  EXPECT_EQ(host_->entities().size(), 6u);
  EXPECT_THAT(node_->entities(), IsEmpty());
}

// Each interface gets its limit, and one more.
TEST_F(ParameterServicesTest, RefuseListsAboveTheLimit) {
  const std::vector<std::string> most(kMostEntries, "a_boolean");
  std::vector<std::string> more = most;
  more.emplace_back("a_boolean");
  const auto values = [&](const auto& names) {
    return call<services::GetParameters>("get_parameters", about<services::GetParameters>(names))
        .values.size();
  };
  EXPECT_EQ(values(most), most.size());
  EXPECT_EQ(values(more), 0U);
  const auto types = [&](const auto& names) {
    return call<services::GetParameterTypes>("get_parameter_types",
                                             about<services::GetParameterTypes>(names))
        .types.size();
  };
  EXPECT_EQ(types(most), most.size());
  EXPECT_EQ(types(more), 0U);
  const auto described = [&](const auto& names) {
    return call<services::DescribeParameters>("describe_parameters",
                                              about<services::DescribeParameters>(names))
        .descriptors.size();
  };
  EXPECT_EQ(described(most), most.size());
  EXPECT_EQ(described(more), 0U);
  const auto listed = [&](const auto& prefixes) {
    return call<services::ListParameters>(
               "list_parameters", services::ListParameters::Request().set__prefixes(prefixes))
        .result.names.size();
  };
  EXPECT_EQ(listed(most), 1U);
  EXPECT_EQ(listed(more), 0U);
  std::vector<std::pair<std::string, wire::ParameterValue>> set(
      kMostEntries, {"b_integer", to_message(std::int64_t{8})});
  EXPECT_EQ(call<services::SetParameters>("set_parameters", to_set(set)).results.size(),
            kMostEntries);
  set.push_back({"b_integer", to_message(std::int64_t{9})});
  const auto refused = call<services::SetParameters>("set_parameters", to_set(set)).results;
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_THAT(refused[0].reason, HasSubstr("a list of 10001 entries is refused"));
  EXPECT_EQ(node_->get_parameter<std::int64_t>("b_integer"), 8);
  services::SetParametersAtomically::Request together;
  together.parameters = to_set(set).parameters;
  const auto result =
      call<services::SetParametersAtomically>("set_parameters_atomically", together).result;
  EXPECT_FALSE(result.successful);
  EXPECT_THAT(result.reason, HasSubstr("a list of 10001 entries is refused"));
}

TEST_F(ParameterServicesTest, GetValuesOfAllTypes) {
  const auto response = call<services::GetParameters>(
      "get_parameters", about<services::GetParameters>(names_of(all_types())));
  ASSERT_EQ(response.values.size(), 9u);
  std::size_t i = 0;
  for (const auto& [name, value] : all_types()) {
    EXPECT_EQ(from_message(response.values[i++]), value) << name;
  }
  EXPECT_THAT(call<services::GetParameterTypes>(
                  "get_parameter_types", about<services::GetParameterTypes>(names_of(all_types())))
                  .types,
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST_F(ParameterServicesTest, GiveNothingWhenOneNameIsUnknown) {
  const std::vector<std::string> names{"a_boolean", "unknown"};
  EXPECT_THAT(
      call<services::GetParameters>("get_parameters", about<services::GetParameters>(names)).values,
      IsEmpty());
  EXPECT_THAT(call<services::GetParameterTypes>("get_parameter_types",
                                                about<services::GetParameterTypes>(names))
                  .types,
              IsEmpty());
  EXPECT_THAT(call<services::DescribeParameters>("describe_parameters",
                                                 about<services::DescribeParameters>(names))
                  .descriptors,
              IsEmpty());
}

TEST_F(ParameterServicesTest, SetOneAfterAnother) {
  const auto response = call<services::SetParameters>(
      "set_parameters", to_set({{"b_integer", to_message(std::int64_t{8})},
                                {"b_integr", to_message(std::int64_t{9})},
                                {"d_string", to_message(true)},
                                {"loop.gain", to_message(1.5)},
                                {"loop.gain", to_message(1.6)},
                                {"loop.count", to_message(std::int64_t{5})},
                                {"c_number", {}}}));
  std::vector<std::string> reasons;
  for (const auto& result : response.results) {
    EXPECT_EQ(result.successful, result.reason.empty());
    reasons.push_back(result.reason);
  }
  EXPECT_THAT(
      reasons,
      ElementsAre(
          "", HasSubstr("no parameter 'b_integr'; did you mean 'b_integer'?"),
          HasSubstr("cannot be true; give a string"), "",
          HasSubstr("cannot be 1.6; give a floating-point number from 0 to 2 in "
                    "steps of 0.5"),
          HasSubstr("is read-only"),
          HasSubstr("'c_number' of node 'camera' cannot be undeclared: its type is fixed")));
  EXPECT_EQ(node_->get_parameter<int>("b_integer"), 8);
  EXPECT_EQ(node_->get_parameter<double>("loop.gain"), 1.5);
}

TEST_F(ParameterServicesTest, SetAllTypesAtomicallyOrNone) {
  const Parameters values{{"a_boolean", false},
                          {"b_integer", std::int64_t{1}},
                          {"c_number", 2.0},
                          {"d_string", std::string("odom")},
                          {"dd_bytes", std::vector<std::uint8_t>{7}},
                          {"e_booleans", std::vector<bool>{}},
                          {"f_integers", std::vector<std::int64_t>{3}},
                          {"g_numbers", std::vector<double>{0.125}},
                          {"h_strings", std::vector<std::string>{"c"}}};
  services::SetParametersAtomically::Request request;
  for (const auto& [name, value] : values) {
    request.parameters.push_back(wire::Parameter().set__name(name).set__value(to_message(value)));
  }
  request.parameters.push_back(
      wire::Parameter().set__name("loop.gain").set__value(to_message(3.0)));
  const auto refused =
      call<services::SetParametersAtomically>("set_parameters_atomically", request);
  EXPECT_FALSE(refused.result.successful);
  EXPECT_THAT(refused.result.reason, HasSubstr("'loop.gain' of node 'camera' cannot be 3"));
  EXPECT_TRUE(node_->get_parameter<bool>("a_boolean"));
  request.parameters.pop_back();
  EXPECT_TRUE(call<services::SetParametersAtomically>("set_parameters_atomically", request)
                  .result.successful);
  for (const auto& [name, value] : values) {
    EXPECT_EQ(node_->get_parameter<ParameterValue>(name), value);
  }
}

TEST_F(ParameterServicesTest, ReturnTheReasonOfACallback) {
  const auto handle = node_->add_on_set_parameters_callback([](const Parameters&) {
    return SetParametersResult{false, "not today"};
  });
  const auto response =
      call<services::SetParameters>("set_parameters", to_set({{"a_boolean", to_message(false)}}));
  ASSERT_EQ(response.results.size(), 1u);
  EXPECT_EQ(response.results[0].reason, "not today");
}

TEST_F(ParameterServicesTest, ListWithPrefixesAndDepth) {
  const auto all = call<services::ListParameters>("list_parameters", {}).result;
  EXPECT_EQ(all.names.size(), 12u);
  EXPECT_THAT(all.prefixes, ElementsAre("loop"));
  const auto some = call<services::ListParameters>(
                        "list_parameters",
                        services::ListParameters::Request().set__prefixes({"loop"}).set__depth(1))
                        .result;
  EXPECT_THAT(some.names, ElementsAre("loop.count", "loop.gain"));
  EXPECT_EQ(call<services::ListParameters>("list_parameters",
                                           services::ListParameters::Request().set__depth(1))
                .result.names.size(),
            10u);
}

TEST_F(ParameterServicesTest, DescribeParameters) {
  const auto response = call<services::DescribeParameters>(
      "describe_parameters",
      about<services::DescribeParameters>({"loop.gain", "loop.count", "d_string"}));
  ASSERT_EQ(response.descriptors.size(), 3u);
  const auto& [gain, count, text] =
      std::tie(response.descriptors[0], response.descriptors[1], response.descriptors[2]);
  EXPECT_EQ(gain.name, "loop.gain");
  EXPECT_EQ(gain.type, ParameterType::PARAMETER_DOUBLE);
  EXPECT_EQ(gain.description, "of the loop");
  EXPECT_EQ(gain.additional_constraints, "even halves");
  EXPECT_FALSE(gain.dynamic_typing);
  EXPECT_FALSE(gain.read_only);
  ASSERT_EQ(gain.floating_point_range.size(), 1u);
  EXPECT_EQ(gain.floating_point_range[0].to_value, 2);
  EXPECT_EQ(gain.floating_point_range[0].step, 0.5);
  EXPECT_TRUE(count.read_only);
  ASSERT_EQ(count.integer_range.size(), 1u);
  EXPECT_EQ(count.integer_range[0].from_value, 1);
  EXPECT_EQ(count.integer_range[0].step, 2u);
  EXPECT_EQ(text.type, ParameterType::PARAMETER_STRING);
  EXPECT_THAT(text.integer_range, IsEmpty());
}

// As rclcpp's do: a parameter of any type is undeclared by setting it to no value.
TEST_F(ParameterServicesTest, UndeclareWhatIsSetToNothing) {
  node_->declare_parameter("any", ParameterValue(true), {.dynamic_typing = true});
  const auto description = call<services::DescribeParameters>(
                               "describe_parameters", about<services::DescribeParameters>({"any"}))
                               .descriptors;
  ASSERT_EQ(description.size(), 1u);
  EXPECT_TRUE(description[0].dynamic_typing);
  EXPECT_EQ(description[0].type, ParameterType::PARAMETER_BOOL);
  const auto set = [&](const wire::ParameterValue& value) {
    return call<services::SetParameters>("set_parameters", to_set({{"any", value}}))
        .results.at(0)
        .reason;
  };
  EXPECT_EQ(set(to_message(std::vector<std::uint8_t>{1, 2})), "");
  EXPECT_THAT(call<services::GetParameterTypes>("get_parameter_types",
                                                about<services::GetParameterTypes>({"any"}))
                  .types,
              ElementsAre(ParameterType::PARAMETER_BYTE_ARRAY));
  const auto reader = caller_->create_subscription<wire::ParameterEvent>("/parameter_events", 10,
                                                                         [](const auto&) {});
  EXPECT_EQ(set({}), "");
  EXPECT_FALSE(node_->has_parameter("any"));
  EXPECT_THAT(set({}), HasSubstr("no parameter 'any'"));
  wire::ParameterEvent event;
  ASSERT_TRUE(reader->take(event));
  EXPECT_THAT(event.changed_parameters, IsEmpty());
  ASSERT_EQ(event.deleted_parameters.size(), 1u);
  EXPECT_EQ(event.deleted_parameters[0].name, "any");
  EXPECT_FALSE(reader->take(event));
}

// The services serve on one thread, while the code undeclares on another one.
TEST_F(ParameterServicesTest, AnswerWhileParametersComeAndGo) {
  std::atomic<bool> is_over{false};
  std::thread code([&] {
    while (!is_over) {
      node_->declare_parameter("any", ParameterValue(0.5), {.dynamic_typing = true});
      node_->undeclare_parameter("any");
    }
  });
  for (int i = 0; i < 200; ++i) {
    const auto got = call<services::GetParameters>(
        "get_parameters", about<services::GetParameters>({"any", "a_boolean"}));
    EXPECT_THAT(got.values.size(), AnyOf(0u, 2u));
    const auto described = call<services::DescribeParameters>(
        "describe_parameters", about<services::DescribeParameters>({"any", "a_boolean"}));
    EXPECT_THAT(described.descriptors.size(), AnyOf(0u, 2u));
  }
  is_over = true;
  code.join();
}

TEST(ParameterServices, MayBeServedByTheNodeItself) {
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("rate", 30);
  {
    const ParameterServices services(*node, *node);
    EXPECT_EQ(node->entities().size(), 6u);
    EXPECT_TRUE(
        node->create_client<services::GetParameters>("/camera/get_parameters")->service_is_ready());
  }
  EXPECT_THAT(node->entities(), IsEmpty());
}

// The exception kept the response from being sent: the caller waited for ever.
TEST_F(ParameterServicesTest, AnswerWhatACallbackThrowsAndThrowItThen) {
  const auto on_set = node_->add_on_set_parameters_callback([](const Parameters& values) {
    if (values.contains("a_boolean")) throw std::runtime_error("no light");
    return SetParametersResult();
  });
  const auto post_set = node_->add_post_set_parameters_callback([](const Parameters& values) {
    if (values.contains("d_string")) throw 1;
  });
  const auto call_failing = [&]<class S>(std::in_place_type_t<S>, const std::string& service,
                                         const typename S::Request& request) {
    const auto client = caller_->create_client<S>("/front/camera/" + service);
    const auto future = client->async_send_request(request);
    int failures = 0;
    const std::vector<std::shared_ptr<Entity>> served = host_->entities();
    for (const auto& entity : served) {
      try {
        serve(*entity);
      } catch (...) {
        ++failures;
      }
    }
    EXPECT_EQ(failures, 1);
    serve(*client);
    return future.get().value();
  };
  const auto each = call_failing(std::in_place_type<services::SetParameters>, "set_parameters",
                                 to_set({{"a_boolean", to_message(false)},
                                         {"d_string", to_message(std::string("odom"))},
                                         {"b_integer", to_message(std::int64_t{8})}}));
  ASSERT_EQ(each.results.size(), 3u);
  EXPECT_FALSE(each.results[0].successful);
  EXPECT_EQ(each.results[0].reason, "a parameter callback of node 'camera' threw: no light");
  EXPECT_FALSE(each.results[1].successful);
  EXPECT_THAT(each.results[1].reason, HasSubstr("threw: an object that is not a std::exception"));
  EXPECT_TRUE(each.results[2].successful);
  services::SetParametersAtomically::Request together;
  together.parameters = to_set({{"a_boolean", to_message(false)}}).parameters;
  const auto result = call_failing(std::in_place_type<services::SetParametersAtomically>,
                                   "set_parameters_atomically", together)
                          .result;
  EXPECT_FALSE(result.successful);
  EXPECT_THAT(result.reason, HasSubstr("threw: no light"));
  EXPECT_TRUE(node_->get_parameter<bool>("a_boolean"));
}

TEST_F(ParameterServicesTest, PublishWhatIsSetAndDeclared) {
  const auto reader =
      host_->create_subscription<wire::ParameterEvent>("/parameter_events", 10, [](const auto&) {});
  wire::ParameterEvent event;
  EXPECT_TRUE(node_->set_parameters_atomically({{"a_boolean", false}}).successful);
  ASSERT_TRUE(reader->take(event));
  EXPECT_EQ(event.node, "/front/camera");
  EXPECT_THAT(event.new_parameters, IsEmpty());
  ASSERT_EQ(event.changed_parameters.size(), 1u);
  EXPECT_EQ(event.changed_parameters[0].name, "a_boolean");
  EXPECT_EQ(from_message(event.changed_parameters[0].value), ParameterValue(false));
  node_->declare_parameter("later", 1);
  ASSERT_TRUE(reader->take(event));
  ASSERT_EQ(event.new_parameters.size(), 1u);
  EXPECT_EQ(event.new_parameters[0].name, "later");
  EXPECT_FALSE(node_->set_parameters_atomically({{"loop.gain", 7.0}}).successful);
  EXPECT_FALSE(reader->take(event));
}

}  // namespace
}  // namespace takt
