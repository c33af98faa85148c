// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <fstream>

#include "takt/base/temporary.hpp"

#include "rclcpp_test.hpp"

namespace rclcpp {
namespace {

/// A node whose own arguments these are.
std::shared_ptr<Node> node_with(std::vector<std::string> arguments,
                                const std::string& name_space = "") {
  arguments.insert(arguments.begin(), "--ros-args");
  return std::make_shared<Node>("camera", name_space, NodeOptions().arguments(arguments));
}

using Arguments = RclcppTest;

// A namespace for the node's new name was not found, as it was looked up by its old one.
TEST_F(Arguments, RulesOfANodeHaveTheNameThatItGets) {
  const auto node = node_with({"-r", "camera:__node:=left", "-r", "left:__ns:=/front", "-r",
                               "camera:image:=other", "-r", "left:image:=scan", "-p",
                               "camera:rate:=1", "-p", "left:rate:=2"});
  EXPECT_STREQ(node->get_fully_qualified_name(), "/front/left");
  EXPECT_EQ(node->get_node_base_interface()->resolve_topic_or_service_name("image", false),
            "/front/scan");
  EXPECT_THROW(node->declare_parameter<int>("rate"),
               exceptions::UninitializedStaticallyTypedParameterException);  // "/left" is another
}

TEST_F(Arguments, RulesMayBeOfTopicsOrServices) {
  const auto node = node_with({"-r", "rostopic://a:=b", "-r", "camera:rosservice://a:=c", "-r",
                               "~/d:=/e", "--", "--remap", "ignored"});
  const auto base = node->get_node_base_interface();
  EXPECT_EQ(base->resolve_topic_or_service_name("a", false), "/b");
  EXPECT_EQ(base->resolve_topic_or_service_name("/a", true), "/c");
  EXPECT_EQ(base->resolve_topic_or_service_name("~/d", false), "/e");
}

TEST_F(Arguments, FilesOfParametersHaveWildcards) {
  const takt::TemporaryFolder folder;
  const std::string file = folder / "parameters.yaml";
  std::ofstream(file) << "/**: {ros__parameters: {all: 1, deep: {er: 2}}}\n"
                         "/*: {ros__parameters: {root: 3}}\n"
                         "/*/camera: {ros__parameters: {one_above: 4}}\n"
                         "/**/camera: {ros__parameters: {all: 5}}\n"
                         "front: {camera: {ros__parameters: {nested: [1, 2.5]}}}\n";
  const auto node =
      std::make_shared<Node>("camera", "front",
                             NodeOptions()
                                 .arguments({"--ros-args", "--params-file", file, "-p", "late:=6"})
                                 .automatically_declare_parameters_from_overrides(true));
  EXPECT_EQ(node->get_parameter("all").as_int(), 5);
  EXPECT_EQ(node->get_parameter("deep.er").as_int(), 2);
  EXPECT_FALSE(node->has_parameter("root"));
  EXPECT_EQ(node->get_parameter("one_above").as_int(), 4);
  EXPECT_EQ(node->get_parameter("nested").as_double_array(), (std::vector<double>{1, 2.5}));
  EXPECT_EQ(node->get_parameter("late").as_int(), 6);
}

TEST_F(Arguments, AnEmptyListHasTheTypeThatIsDeclared) {
  const takt::TemporaryFolder folder;
  const std::string file = folder / "parameters.yaml";
  std::ofstream(file)
      << "camera:\n  ros__parameters: {i: [], d: [], s: [], b: [], id: !!str 010, on: on}\n";
  const auto node = node_with({"--params-file", file, "-p", "u:=[]"});
  EXPECT_EQ(node->declare_parameter("i", std::vector<std::int64_t>{7}),
            std::vector<std::int64_t>());
  EXPECT_EQ(node->declare_parameter("d", std::vector<double>{7}), std::vector<double>());
  EXPECT_EQ(node->declare_parameter("s", std::vector<std::string>{"a"}),
            std::vector<std::string>());
  EXPECT_EQ(node->declare_parameter("b", PARAMETER_BOOL_ARRAY).get<std::vector<bool>>(),
            std::vector<bool>());
  EXPECT_EQ(node->declare_parameter("u", std::vector<std::uint8_t>{7}),
            std::vector<std::uint8_t>());
  EXPECT_EQ(node->declare_parameter("id", ""), "010");
  EXPECT_TRUE(node->declare_parameter("on", false));
  EXPECT_THROW(node_with({"-p", "i:=[]"})->declare_parameter("i", 5),
               exceptions::InvalidParameterTypeException);
}

// A flag at the end counted as unknown, and what cannot be a name came to the node, or was ignored.
TEST_F(Arguments, WrongOnesAreRefused) {
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"-r"},
                                             {"--remap"},
                                             {"-p"},
                                             {"--params-file"},
                                             {"--log-level"},
                                             {"-e"},
                                             {"--log-config-file"},
                                             {"-r", "a"},
                                             {"-r", ":=a"},
                                             {"-r", "a:="},
                                             {"-r", "a:=b/"},
                                             {"-r", "a b:=c"},
                                             {"-r", "a:=b c"},
                                             {"-r", "*:=a"},
                                             {"-r", "/n:a:=b"},
                                             {"-r", "__ns:=a"},
                                             {"-r", "__node:=/a"},
                                             {"-r", "__node:=1"},
                                             {"-p", "a"},
                                             {"-p", ":=1"},
                                             {"-p", "n:=[1, a]"},
                                             {"-p", "n:="},
                                             {"-p", "n:=[[1]]"},
                                             {"-p", "n:=[&a 1, *a]"},
                                             {"-p", "/n:a:=1"},
                                             {"--params-file", "/none"},
                                             {"--log-level", "loud"},
                                             {"--log-level", ":=info"},
                                             {"--log-level", "a:=loud"}}) {
    EXPECT_THROW(node_with(wrong), exceptions::RCLInvalidROSArgsError)
        << testing::PrintToString(wrong);
  }
  for (const std::string unknown : {"--what", "a:=b", "-x", "--enable-nothing"}) {
    EXPECT_THROW(node_with({unknown}), exceptions::UnknownROSArgsError) << unknown;
  }
}

TEST_F(Arguments, LevelsAreOfOneLoggerOrOfAll) {
  const auto context = std::make_shared<Context>();
  const char* const arguments[] = {
      "program", "--ros-args", "--log-level", "arguments_test:=ERROR", "--log-level", "info"};
  context->init(std::size(arguments), arguments);
  EXPECT_EQ(get_logger("arguments_test").get_effective_level(), Logger::Level::Error);
  EXPECT_EQ(get_logger("arguments_test_2").get_effective_level(), Logger::Level::Info);
  context->shutdown("end");
}

// It was an error of the first node, and none of rclcpp's.
TEST(InitDeathTest, AWrongDomainIsAnErrorOfInit) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("ROS_DOMAIN_ID", "many", 1);
        try {
          rclcpp::init(0, nullptr);
        } catch (const exceptions::RCLError& error) {
          std::fputs(error.what(), stderr);
          std::exit(rclcpp::ok() ? 1 : 0);
        }
      },
      testing::ExitedWithCode(0), "ROS_DOMAIN_ID is 'many'");
}

TEST(LoggingDeathTest, TheEnvironmentGivesTheFormatOfLines) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("TZ", "UTC", 1);
        setenv("RCUTILS_CONSOLE_OUTPUT_FORMAT",
               "{severity}\\t{name}\\n{message} {line_number} {what} {date_time_with_ms}.", 1);
        setenv("RCUTILS_COLORIZED_OUTPUT", "1", 1);
        RCLCPP_WARN(get_logger("a.b"), "text");
        std::exit(0);
      },
      testing::ExitedWithCode(0),
      "33mWARN\ta.b\ntext [0-9]+ .what. 20[0-9]+-[0-9]+-[0-9]+ [0-9]+:[0-9]+:[0-9]+.[0-9]+[.]");
}

}  // namespace
}  // namespace rclcpp
