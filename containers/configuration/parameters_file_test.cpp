// Parameter files of ROS 2 in a configuration file: `parameters_file`.
// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

constexpr std::string_view kRobot = R"(
container:
  components:
    - {component: takt::Workload, name: lidar, namespace: /front, parameters_file: params.yaml,
       parameters: {period_ms: 5}}
)";

class ParametersFile : public testing::Test {
 protected:
  explicit ParametersFile(std::string_view robot = kRobot) : file_("robot.yaml", robot) {}

  void write(std::string_view text) { std::ofstream(folder() / "params.yaml") << text; }
  std::filesystem::path folder() const { return std::filesystem::path(file_.path()).parent_path(); }

  const ConfigurationFile file_;
};

TEST_F(ParametersFile, GivesWhatTheFileItselfDoesNotSay) {
  write(
      "/front/lidar:\n  ros__parameters: {rate: 010, period_ms: 7}\n"
      "/**:\n  ros__parameters: {rate: 1, flag: on, gain: {p: 0.5}}\n"
      "/rear/lidar:\n  ros__parameters: {rate: 3}\n");
  const SystemDescription system = file_.read();
  EXPECT_THAT(system.components.at(0).parameters,
              ElementsAre(Pair("flag", ParameterValue(true)), Pair("gain.p", ParameterValue(0.5)),
                          Pair("period_ms", ParameterValue(std::int64_t{5})),
                          Pair("rate", ParameterValue(std::int64_t{8}))));
  EXPECT_EQ(system.components.at(0).parameter_lines.at("rate"),
            (folder() / "params.yaml").string() + ":2");
  EXPECT_THAT(system.parameter_files, ElementsAre((folder() / "params.yaml").string()));
}

TEST_F(ParametersFile, IsRefusedWithItsLines) {
  const auto errors = [this](std::string_view text) {
    write(text);
    return file_.errors();
  };
  EXPECT_THAT(errors("/rear/lidar: {ros__parameters: {rate: 3}}"),
              testing::AllOf(HasSubstr("robot.yaml:4: "), HasSubstr("params.yaml:1: "),
                             HasSubstr("no section is for node '/front/lidar'; there are sections "
                                       "for /rear/lidar")));
  EXPECT_THAT(errors("/front/lidar:\n  ros__parameters: {rate: [1, a]}"),
              HasSubstr("params.yaml:2: "));
  EXPECT_THAT(errors("- 1"), HasSubstr("this is no file of parameters"));
}

TEST_F(ParametersFile, ThatIsMissingIsNamed) {
  EXPECT_THAT(file_.errors(), testing::AllOf(HasSubstr("robot.yaml:4: "), HasSubstr("params.yaml"),
                                             HasSubstr("cannot be read")));
}

TEST(ParametersFileOfAnUnnamedNode, IsRefused) {
  const ConfigurationFile file("robot.yaml",
                               "container:\n  components:\n    - component: takt::Workload\n"
                               "      parameters_file: params.yaml\n");
  EXPECT_EQ(file.errors(),
            "robot.yaml:4: a parameter file is for nodes by their names, and this component has "
            "none here; add 'name'\n");
}

}  // namespace
}  // namespace takt
