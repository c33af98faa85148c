// What a request to load a component may say.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component_manager.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/messages/entries.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_type.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using rcl_interfaces::msg::Parameter;
using rcl_interfaces::msg::ParameterType;
using testing::HasSubstr;
using testing::StartsWith;
using Request = composition_interfaces::srv::LoadNode::Request;

Parameter text(const std::string& name, const std::string& value) {
  Parameter parameter;
  parameter.name = name;
  parameter.value.set__type(ParameterType::PARAMETER_STRING).set__string_value(value);
  return parameter;
}
Parameter number(const std::string& name, std::int64_t value) {
  Parameter parameter;
  parameter.name = name;
  parameter.value.set__type(ParameterType::PARAMETER_INTEGER).set__integer_value(value);
  return parameter;
}

Parameter flag(const std::string& name, bool value) {
  Parameter parameter;
  parameter.name = name;
  parameter.value.set__type(ParameterType::PARAMETER_BOOL).set__bool_value(value);
  return parameter;
}

Request workload() {
  provide_workload();
  Request request;
  request.package_name = "not_looked_at";
  request.plugin_name = "takt::Workload";
  return request;
}

std::string errors_of(const Request& request) {
  try {
    describe(request, {"fast", "default"}, {});
    return "no error";
  } catch (const ConfigurationError& error) {
    return error.what();
  }
}

// 200,000 rules of a peer held a container up for 20 s, and its end, too.
TEST(LoadNode, RefusesListsAboveTheLimit) {
  Request request = workload();
  for (std::size_t i = 0; i < kMostEntries; ++i) {
    request.remap_rules.push_back(fmt::format("a{}:=b", i));
    request.parameters.push_back(number(fmt::format("p{}", i), 1));
  }
  const auto described = describe(request, {"default"}, {});
  EXPECT_EQ(described.remap.size(), kMostEntries);
  EXPECT_EQ(described.parameters.size(), kMostEntries);
  Request rules = request, parameters = request, arguments = request;
  rules.remap_rules.emplace_back("a:=b");
  parameters.parameters.push_back(number("p", 1));
  arguments.extra_arguments.resize(kMostEntries + 1);
  for (const Request& longer : {rules, parameters, arguments}) {
    EXPECT_THAT([&] { describe(longer, {"default"}, {}); },
                testing::ThrowsMessage<Error>(HasSubstr("a list of 10001 entries is refused")));
  }
}

TEST(LoadNode, SaysWhatAFileWouldSay) {
  Request request = workload();
  request.node_name = "imu";
  request.node_namespace = "/front";
  request.log_level = 40;
  request.remap_rules = {"raw:=/imu/raw"};
  request.parameters = {number("rate_hz", 10), text("frame.id", "base")};
  Parameter list;
  list.name = "list";
  list.value.set__type(ParameterType::PARAMETER_INTEGER_ARRAY).set__integer_array_value({1, 2});
  request.parameters.push_back(list);
  request.extra_arguments = {text("executor", "fast"),
                             text("on_exception", "ignore"),
                             number("callback_group.loop.priority", 90),
                             text("callback_group.loop.deadline", "2ms"),
                             text("callback_group.rest.executor", "default"),
                             flag("use_intra_process_comms", false),
                             flag("forward_global_arguments", true)};
  const ComponentDescription component = describe(request, {"fast", "default"}, {});
  EXPECT_EQ(component.type, "takt::Workload");
  EXPECT_EQ(full_name(component), "/front/imu");
  EXPECT_EQ(component.log_level, LogLevel::error);
  EXPECT_EQ(component.remap.at("raw"), "/imu/raw");
  EXPECT_EQ(component.parameters.at("rate_hz"), ParameterValue(std::int64_t{10}));
  EXPECT_EQ(component.parameters.at("frame.id"), ParameterValue("base"));
  EXPECT_EQ(component.parameters.at("list"), ParameterValue(std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(component.executor, "fast");
  EXPECT_EQ(component.on_exception, OnException::ignore);
  EXPECT_EQ(component.callback_groups.at("loop").parameters.priority, 90);
  EXPECT_EQ(component.callback_groups.at("loop").parameters.deadline, Nanoseconds(2ms));
  EXPECT_EQ(component.callback_groups.at("rest").executor, "default");
}

TEST(LoadNode, TakesRemapRulesAsContainersOfRos2Do) {
  Request request = workload();
  request.remap_rules = {"__node:=imu", "__ns:=/front", "/raw:=data", "~/a:=b", "/raw:=late"};
  const ComponentDescription component = describe(request, {}, {});
  EXPECT_EQ(full_name(component), "/front/imu");
  EXPECT_EQ(component.remap.at("/raw"), "data");
  EXPECT_EQ(component.remap.at("~/a"), "b");
  request.node_name = "gyro";
  EXPECT_EQ(full_name(describe(request, {}, {})), "/front/gyro");
  request.remap_rules = {"imu:raw:=data", "rosservice://a:=b"};
  EXPECT_THAT(errors_of(request), HasSubstr("'imu:raw:=data': a rule for one node"));
}

TEST(LoadNode, ThatIsWrongIsRefusedWithEverythingThatIsWrong) {
  Request request = workload();
  request.remap_rules = {"raw"};
  request.extra_arguments = {text("executor", "fats"), text("exekutor", "fast"),
                             text("callback_group.loop.prio", "1"), text("callback_group.", "1")};
  const std::string errors = errors_of(request);
  EXPECT_THAT(errors, HasSubstr("'raw' is not a remap rule; write from:=to"));
  EXPECT_THAT(errors, HasSubstr("no executor is called 'fats'; did you mean 'fast'?"));
  EXPECT_THAT(errors, HasSubstr("'exekutor' is not an extra argument; valid: executor, library"));
  EXPECT_THAT(errors, HasSubstr("'prio' is not a key of a callback group"));
  EXPECT_THAT(errors, HasSubstr("'callback_group.' is not an extra argument"));
  Request nameless = workload();
  nameless.plugin_name = "";
  EXPECT_NE(errors_of(nameless), "no error");
  Request unset = workload();
  unset.parameters = {Parameter().set__name("empty")};
  EXPECT_THAT(errors_of(unset), HasSubstr("'empty'"));
}

TEST(LoadNode, OfALibraryThatIsNotAllowedIsRefusedBeforeAnythingElse) {
  Request request = workload();
  request.extra_arguments = {text("library", "/nowhere/libguest.so"), text("executor", "fats")};
  try {
    describe(request, {"fast"}, {});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), StartsWith("library '/nowhere/libguest.so' may not be loaded"));
  }
  request = workload();
  try {
    describe(request, {"fast"}, {.kind = LoadPolicy::Kind::off});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), StartsWith("this container loads no components on request"));
  }
}

// A requester could use all rights of the container, as the component did not know of it.
TEST(LoadNode, MakesAGuestWhoseFilesAreWhereTheOwnerSays) {
  const auto guest = [](const LoadPolicy& policy) {
    return describe(workload(), {"default"}, policy).guest;
  };
  ASSERT_TRUE(guest({}));
  EXPECT_EQ(guest({})->recordings, "");
  EXPECT_EQ(guest({.recordings = "/records"})->recordings, "/records");
}

}  // namespace
}  // namespace takt
