// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "rclcpp_test.hpp"
#include "rcpputils/asserts.hpp"
#include "rcpputils/env.hpp"
#include "rcpputils/rolling_mean_accumulator.hpp"
#include "rcpputils/shared_library.hpp"
#include "rcpputils/split.hpp"
#include "rcutils/time.h"

namespace rclcpp {
namespace {

using Values = RclcppTest;

TEST_F(Values, TimesOfTwoKindsOfClocksDoNotMix) {
  const Time ros(1, 500, RCL_ROS_TIME), system(2, 0);
  EXPECT_THROW((void)(ros < system), std::runtime_error);
  EXPECT_THROW((void)(ros - system), std::runtime_error);
  EXPECT_EQ((system - Time(1, 0)).seconds(), 1.0);
  EXPECT_THROW((void)(Time(INT64_MAX) + Duration(1, 0)), std::overflow_error);
  EXPECT_THROW(Time(-1, 0), std::runtime_error);
  const builtin_interfaces::msg::Time message = ros;
  EXPECT_EQ(Time(message), ros);
  EXPECT_EQ(Node("node").now().get_clock_type(), RCL_ROS_TIME);
  EXPECT_EQ(Duration(1500ms), Duration::from_seconds(1.5));
}

TEST_F(Values, TimesAndDurationsAreComparedWithMessages) {
  const builtin_interfaces::msg::Time stamp = Time(3, 0);
  EXPECT_TRUE(stamp + Duration(1, 5) - Duration(2, 0) == Time(2, 5));
  EXPECT_TRUE(stamp == rclcpp::Time(3, 0))
      << "the left one decides: a message has no type of clock";
  EXPECT_THROW((void)(rclcpp::Time(3, 0) == stamp), std::runtime_error);
  EXPECT_TRUE(rclcpp::Time(3, 0, RCL_ROS_TIME) == stamp && stamp != rclcpp::Time(4, 0));
  const builtin_interfaces::msg::Duration span = Duration(3, 0);
  EXPECT_TRUE(span == rclcpp::Duration(3, 0) && rclcpp::Duration(4, 0) != span);
}

TEST_F(Values, AnOverrideMustHaveTheTypeOfItsParameter) {
  const auto node = std::make_shared<Node>(
      "node", NodeOptions()
                  .arguments({"--ros-args", "-p", "count:=5", "-p", "gain:=1", "-p", "text:='1'"})
                  .append_parameter_override("count", 7));
  EXPECT_EQ(node->declare_parameter("count", 1), 7);
  EXPECT_THROW(node->declare_parameter("gain", 0.5), exceptions::InvalidParameterTypeException);
  EXPECT_EQ(node->declare_parameter("text", "0"), "1");
  EXPECT_THROW(node->declare_parameter("count", 1), exceptions::ParameterAlreadyDeclaredException);
  EXPECT_THROW(node->declare_parameter("use_sim_time", true),
               exceptions::ParameterAlreadyDeclaredException);
  EXPECT_THROW(node->declare_parameter<double>("none"),
               exceptions::UninitializedStaticallyTypedParameterException);
  EXPECT_EQ(node->get_parameter("count").as_int(), 7);
  EXPECT_THROW(node->get_parameter("count").as_double(), exceptions::InvalidParameterTypeException);
  EXPECT_THROW(node->get_parameter("other"), exceptions::ParameterNotDeclaredException);
  int value = 3;
  EXPECT_FALSE(node->get_parameter("other", value));
  EXPECT_EQ(value, 3);
  EXPECT_EQ(node->get_parameter_or("other", 4), 4);
  EXPECT_THROW(node->set_parameter(Parameter("other", 1)),
               exceptions::ParameterNotDeclaredException);
}

TEST_F(Values, ACallbackIsKeptByItsHandle) {
  const auto node = std::make_shared<Node>("node");
  node->declare_parameter("count", 1);
  auto handle = node->add_on_set_parameters_callback([](const std::vector<Parameter>& parameters) {
    rcl_interfaces::msg::SetParametersResult result;
    result.successful = parameters[0].as_int() < 10;
    result.reason = "too many";
    return result;
  });
  EXPECT_EQ(node->set_parameter(Parameter("count", 10)).reason, "too many");
  EXPECT_TRUE(node->set_parameter(Parameter("count", 9)).successful);
  handle.reset();
  EXPECT_TRUE(node->set_parameter(Parameter("count", 10)).successful);
  EXPECT_FALSE(node->set_parameter(Parameter("count", "ten")).successful);
}

// As rclcpp 28.1.6 printed them.
TEST_F(Values, AnIntegerIsNoDouble) {
  const auto node = std::make_shared<Node>("node");
  node->declare_parameter("gain", 1.0);
  EXPECT_FALSE(node->set_parameter(Parameter("gain", 1)).successful);
  EXPECT_TRUE(node->set_parameter(Parameter("gain", 2.0)).successful);
}

// An infinite value was equal to every end of a range.
TEST_F(Values, WhatIsInfiniteIsInNoFiniteRange) {
  const auto node = std::make_shared<Node>("node");
  rcl_interfaces::msg::ParameterDescriptor descriptor;
  descriptor.floating_point_range.resize(1);
  descriptor.floating_point_range[0].to_value = 10;
  node->declare_parameter("gain", 1.0, descriptor);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double value : {kInfinity, -kInfinity, 1e308, std::nan("")}) {
    EXPECT_FALSE(node->set_parameter(Parameter("gain", value)).successful) << value;
  }
  EXPECT_TRUE(node->set_parameter(Parameter("gain", 10.0)).successful);
}

// Of a node that allows it, only its own calls could set what was not declared.
TEST_F(Values, OthersMaySetWhatIsNotDeclared) {
  const auto node = std::make_shared<Node>("node", NodeOptions().allow_undeclared_parameters(true));
  const auto client_node = std::make_shared<Node>("client");
  AsyncParametersClient client(client_node, "node");
  executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  executor.add_node(client_node);
  ASSERT_TRUE(client.wait_for_service(kLong));
  auto results = client.set_parameters({Parameter("fresh", 5)});
  ASSERT_EQ(executor.spin_until_future_complete(results, kLong), FutureReturnCode::SUCCESS);
  EXPECT_TRUE(results.get().at(0).successful);
  EXPECT_EQ(node->get_parameter("fresh").as_int(), 5);
  EXPECT_TRUE(node->set_parameter(Parameter("fresh", "of another type")).successful);
  auto values = client.get_parameters({"fresh", "none"});
  ASSERT_EQ(executor.spin_until_future_complete(values, kLong), FutureReturnCode::SUCCESS);
  ASSERT_EQ(values.get().size(), 2u);
  EXPECT_EQ(values.get()[1].get_type(), PARAMETER_NOT_SET);
  EXPECT_FALSE(node->has_parameter("none"));
}

TEST_F(Values, ParametersAreCopiedToAnotherNode) {
  const auto from = std::make_shared<Node>("from"), to = std::make_shared<Node>("to");
  from->declare_parameter("gain", 2.5);
  from->declare_parameter("name", "from");
  from->declare_parameter("kind", 1);
  to->declare_parameter("name", "to");
  to->declare_parameter("kind", "of another type");
  copy_all_parameter_values(from, to);
  EXPECT_EQ(to->get_parameter("gain").as_double(), 2.5);
  EXPECT_EQ(to->get_parameter("name").as_string(), "to");
  copy_all_parameter_values(from, to, true);
  EXPECT_EQ(to->get_parameter("name").as_string(), "from");
  EXPECT_EQ(to->get_parameter("kind").as_string(), "of another type");
}

TEST_F(Values, ANodeHasAClockOfTheKindThatItsOptionsSay) {
  for (const auto kind : {RCL_STEADY_TIME, RCL_SYSTEM_TIME, RCL_ROS_TIME}) {
    EXPECT_EQ(Node("node", NodeOptions().clock_type(kind)).now().get_clock_type(), kind);
  }
}

TEST_F(Values, ParametersArePrintedAsInRclcpp) {
  const auto text = [](auto value) { return Parameter("name", value).value_to_string(); };
  EXPECT_EQ(text(std::vector<std::uint8_t>{1, 2, 255}), "[0x1, 0x2, 0xff]");
  EXPECT_EQ(text(std::vector<std::string>{"x", "y z"}), "[x, y z]");
  EXPECT_EQ(text(std::vector<double>{0.5}), "[0.5]");
  EXPECT_EQ(text(std::vector<bool>{true, false}), "[true, false]");
  EXPECT_EQ(text(std::vector<std::int64_t>{-1, 1}), "[-1, 1]");
  EXPECT_EQ(text(std::vector<std::int64_t>{}), "[]");
  EXPECT_EQ(text(2.5), "2.500000");
}

TEST_F(Values, UnknownArgumentsAreRefused) {
  EXPECT_THROW(Node("node", NodeOptions().arguments({"--ros-args", "--what"})),
               exceptions::UnknownROSArgsError);
  const char* const arguments[] = {"program", "--own", "--ros-args", "-r", "a:=b", "--", "x"};
  EXPECT_EQ(remove_ros_arguments(7, arguments),
            (std::vector<std::string>{"program", "--own", "x"}));
}

TEST_F(Values, LoggersTakeTheLevelsOfTheirParents) {
  static bool is_first = true;  // what is logged once is not logged by a repetition
  if (!std::exchange(is_first, false)) GTEST_SKIP();
  const Logger logger = get_logger("values_test"), child = logger.get_child("child");
  EXPECT_STREQ(child.get_name(), "values_test.child");
  int evaluated = 0;
  const auto count = [&] { return ++evaluated; };
  RCLCPP_DEBUG(child, "%d", count());
  EXPECT_EQ(evaluated, 0);
  get_logger("values_test").set_level(Logger::Level::Debug);
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) {
    RCLCPP_DEBUG_ONCE(child, "%d", count());
    RCLCPP_INFO_STREAM_THROTTLE(child, *std::make_shared<Clock>(), 1'000'000, "x" << count());
    RCLCPP_WARN_SKIPFIRST(child, "%s %d", "not first", i);
  }
  const std::string written = testing::internal::GetCapturedStderr();
  EXPECT_EQ(evaluated, 2);
  EXPECT_NE(written.find("[INFO] ["), std::string::npos);
  EXPECT_NE(written.find("] [values_test.child]: x2\n"), std::string::npos) << written;
  EXPECT_EQ(written.find("not first 0"), std::string::npos);
}

TEST_F(Values, AQoSIsMadeInEveryHabit) {
  EXPECT_EQ(QoS(10).depth(), 10u);
  EXPECT_EQ(SensorDataQoS().reliability(), ReliabilityPolicy::BestEffort);
  EXPECT_EQ(QoS(KeepLast(1)).transient_local().durability(), DurabilityPolicy::TransientLocal);
  const QoS from_c(QoSInitialization::from_rmw(rmw_qos_profile_sensor_data),
                   rmw_qos_profile_sensor_data);
  EXPECT_EQ(from_c, SensorDataQoS());
  EXPECT_NE(QoS(1), QoS(2));
  const QoS kept = QoS(3).deadline(100ms).lifespan(Duration(2, 0));
  EXPECT_EQ(QoS::from_takt(kept.to_takt(true)).deadline(), Duration(100ms));
}

TEST(Rcpputils, VariablesOfTheEnvironmentAreSetAndRead) {
  EXPECT_TRUE(rcpputils::set_env_var("OF_THIS_TEST", "1"));
  EXPECT_EQ(rcpputils::get_env_var("OF_THIS_TEST"), "1");
  EXPECT_TRUE(rcpputils::set_env_var("OF_THIS_TEST", nullptr));
  EXPECT_EQ(rcpputils::get_env_var("OF_THIS_TEST"), "");
  EXPECT_THROW(rcpputils::set_env_var("", "1"), std::runtime_error);
}

TEST(Rcutils, HasTheTime) {
  rcutils_time_point_value_t before = 0, now = 0;
  ASSERT_EQ(rcutils_system_time_now(&before), RCUTILS_RET_OK);
  EXPECT_LT(RCUTILS_S_TO_NS(1'600'000'000), before);
  ASSERT_EQ(rcutils_steady_time_now(&before), RCUTILS_RET_OK);
  ASSERT_EQ(rcutils_steady_time_now(&now), RCUTILS_RET_OK);
  EXPECT_LE(before, now);
  EXPECT_EQ(rcutils_steady_time_now(nullptr), RCUTILS_RET_INVALID_ARGUMENT);
}

TEST(Rcpputils, ChecksThrow) {
  EXPECT_NO_THROW(rcpputils::require_true(true));
  EXPECT_THROW(rcpputils::require_true(false), std::invalid_argument);
  EXPECT_THROW(rcpputils::check_true(false), rcpputils::IllegalStateException);
}

TEST(Rcpputils, ATextIsSplit) {
  EXPECT_EQ(rcpputils::split("a//b", '/'), (std::vector<std::string>{"a", "", "b"}));
  EXPECT_EQ(rcpputils::split("/a//b/", '/', true), (std::vector<std::string>{"a", "b"}));
}

TEST(Rcpputils, TheMeanIsThatOfTheLastValues) {
  rcpputils::RollingMeanAccumulator<double> mean(3);
  mean.accumulate(3);
  EXPECT_EQ(mean.getRollingMean(), 3);
  for (const double value : {1, 2, 6}) mean.accumulate(value);
  EXPECT_EQ(mean.getRollingMean(), 3);
}

TEST_F(Values, ALibraryThatIsNotThereIsSaidByName) {
  EXPECT_EQ(rcpputils::get_platform_library_name("nowhere"), "libnowhere.so");
  EXPECT_THROW(rcpputils::SharedLibrary("libnowhere.so"), std::runtime_error);
  rcpputils::SharedLibrary math("libm.so.6");
  EXPECT_TRUE(math.has_symbol("cos"));
  EXPECT_FALSE(math.has_symbol("sine"));
  try {
    math.get_symbol("sine");
    FAIL() << "it has found 'sine'";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), "library '" + math.get_library_path() + "' has no symbol 'sine'");
  }
  const auto cosine = reinterpret_cast<double (*)(double)>(math.get_symbol("cos"));
  math.unload_library();
  EXPECT_THROW(math.get_symbol("cos"), std::runtime_error);
  EXPECT_EQ(cosine(0), 1);  // it stays loaded
}

}  // namespace
}  // namespace rclcpp
