// What is wrong with the modes of a file.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/modes_test.hpp"

namespace takt::modes_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string reading_errors(const std::string& modes) {
  return ConfigurationFile("r.yaml", file_of(modes)).errors();
}

std::string making_errors(const std::string& modes,
                          const std::string& executor = "type: events, scheduler: fixed_priority",
                          const ContainerOverrides& overrides = {}) {
  World any;
  world = &any;
  const ConfigurationFile file("r.yaml", file_of(modes, "", executor));
  try {
    const Container container(file.read(), overrides);
    return "";
  } catch (const ConfigurationError& error) {
    std::string result;
    const std::size_t folder = file.path().size() - std::string("r.yaml").size();
    for (const std::string& each : error.errors()) result += each.substr(folder) + "\n";
    return result;
  }
}

TEST(ModesOfAFile, NormalIsNoNameForOne) {
  EXPECT_EQ(reading_errors("modes: {normal: {drop: [robot/log]}}\n"),
            "r.yaml:2: the mode 'normal' is the one without changes; give yours another name\n");
}

TEST(ModesOfAFile, OneThatChangesNothingIsRefused) {
  EXPECT_EQ(reading_errors("modes: {calm: {}}\n"),
            "r.yaml:2: the mode 'calm' changes nothing; list callbacks under 'drop' or 'demote'\n");
}

TEST(ModesOfAFile, ACallbackIsNamedOnce) {
  EXPECT_EQ(
      reading_errors("modes:\n  calm:\n    drop: [robot/log]\n    demote: [/robot/log]\n"),
      "r.yaml:5: mode 'calm' has 'robot/log' under 'drop' already; name each callback once\n");
}

TEST(ModesOfAFile, OtherKeysAreRefused) {
  EXPECT_THAT(reading_errors("modes: {calm: {drop: [robot/log], budget: 1ms}}\n"),
              HasSubstr("r.yaml:2: 'budget' is not a key of a mode"));
  EXPECT_THAT(reading_errors("modes: {calm: {drop: [robot/log], on: {miss: robot/log}}}\n"),
              HasSubstr("r.yaml:2: 'miss' is not a key of what leads to a mode"));
}

TEST(ModesOfAFile, SeveralProcessesAreRefusedByName) {
  provide<Robot>("test::ModesRobot");
  EXPECT_EQ(ConfigurationFile("r.yaml", R"(modes: {calm: {drop: [a/log]}}
containers:
  - {name: a, components: [{component: test::ModesRobot, name: a}]}
  - {name: b, components: [{component: test::ModesRobot, name: b}]}
)")
                .errors(),
            "r.yaml:1: `modes` is for a file with one process: there are 2; leave it out\n");
  SystemDescription two = system_of(file_of(kModes));
  two.components.push_back(two.components.front());
  two.components.back().name = "other";
  EXPECT_THROW(split(two, Composition::per_node), Error);
}

TEST(ModesOfAFile, CallbacksThatDoNotExistAreNamed) {
  EXPECT_EQ(making_errors("modes: {calm: {drop: [robot/lag], demote: [robot/x], on: {overrun: "
                          "robot/y}}}\n"),
            "r.yaml:2: mode 'calm': there is no callback 'robot/lag'; did you mean 'robot/log'? "
            "valid: robot/log, robot/plan, robot/loop, robot/image, robot/ask\n"
            "r.yaml:2: mode 'calm': there is no callback 'robot/x'; did you mean 'robot/log'? "
            "valid: robot/log, robot/plan, robot/loop, robot/image, robot/ask\n"
            "r.yaml:2: mode 'calm': there is no callback 'robot/y'; did you mean 'robot/log'? "
            "valid: robot/log, robot/plan, robot/loop, robot/image, robot/ask\n");
}

TEST(ModesOfAFile, AServiceCannotBeDropped) {
  EXPECT_EQ(making_errors("modes: {calm: {drop: [robot/ask]}}\n"),
            "r.yaml:2: mode 'calm' cannot drop 'robot/ask', a service: its clients would wait for "
            "ever; demote it, or drop timers and subscriptions\n");
  EXPECT_THAT(making_errors("modes: {calm: {demote: [robot/ask]}}\n"), IsEmpty());
}

TEST(ModesOfAFile, AnOrderWithoutUrgenciesCannotDemote) {
  const std::string modes = "modes: {calm: {demote: [robot/log]}}\n";
  EXPECT_THAT(making_errors(modes, "type: events, scheduler: fifo"),
              HasSubstr("r.yaml:2: mode 'calm' cannot demote 'robot/log': executor 'default' has "
                        "the order of 'fifo', which goes by no urgency; choose one of the "
                        "schedulers chain_edf, chain_priority, edf, fixed_priority, job_priority, "
                        "least_laxity"));
  EXPECT_THAT(making_errors(modes, "type: events, scheduler: edf"), IsEmpty());
  EXPECT_THAT(making_errors(modes, "type: events", {.executor = "single_threaded"}), IsEmpty());
}

TEST(ModesOfAFile, WhatNeverOverrunsLeadsNowhere) {
  EXPECT_EQ(making_errors("modes: {calm: {drop: [robot/log], on: {overrun: robot/image}}}\n"),
            "r.yaml:2: mode 'calm': 'robot/image' never overruns, as it has no budget and no "
            "deadline; give it one of them\n");
}

// In `calm`, `loop` waits for all others: there the second robot would be one too many.
TEST(ModesOfAFile, ALoadedComponentMustKeepTheGuaranteesOfEachMode) {
  provide<Robot>("test::ModesRobot");
  World any;
  world = &any;
  const auto load = [](const std::string& modes) -> std::string {
    SystemDescription system = system_of(modes + R"(
executors: {default: {type: events, scheduler: fixed_priority}}
machine: {exclusive: true}
threads: {container: {}}
chains: [{name: c, deadline: 5ms, path: [robot/loop]}]
container:
  name: box
  components:
    - component: test::ModesRobot
      name: robot
      executor: default
      callbacks: {loop: {priority: 3, budget: 2ms}, plan: {priority: 2, budget: 1ms}, log: {priority: 1, budget: 1ms}}
)");
    Container container(system);
    ComponentDescription second = system.components.front();
    second.name = "second";
    for (auto& [name, callback] : second.callbacks) {
      callback.parameters.priority = 0;
      callback.parameters.budget = 1ms;
    }
    try {
      container.load(second);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(load(""), "");
  EXPECT_THAT(load("modes: {calm: {demote: [robot/loop]}}"),
              HasSubstr("with '/second', in the mode 'calm', chain 'c' could take"));
  world = nullptr;
}

}  // namespace
}  // namespace takt::modes_test
