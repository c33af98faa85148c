// Tests of the reference that the readers of configuration files give of themselves.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/reference.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/removed.hpp"

namespace takt {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::EndsWith;

std::vector<std::string> titles(const std::vector<ReferenceSection>& sections) {
  std::vector<std::string> result;
  for (const ReferenceSection& section : sections) result.push_back(section.title);
  return result;
}

ReferenceKey find(const std::string& title, const std::string& key) {
  for (const ReferenceSection& section : describe_configuration()) {
    if (section.title != title) continue;
    for (const ReferenceKey& found : section.keys) {
      if (found.key == key) return found;
    }
  }
  throw std::runtime_error(title + " has no key " + key);
}

TEST(Reference, HasASectionForEachKindOfMap) {
  EXPECT_THAT(titles(describe_configuration()),
              ElementsAre("the file", "memory", "a thread", "dds", "security", "a topic", "a delay",
                          "a scheduler", "a wait back end", "an executor", "a trigger",
                          "a node of a program", "a callback group", "a callback", "an execution",
                          "an arrival", "a container", "a restart", "a load policy", "a component",
                          "the lifecycle", "a machine", "overheads", "a publishing overhead",
                          "an analysis", "a chain", "a mode", "what leads to a mode"));
  EXPECT_THAT(titles(describe_workload()), ElementsAre("the file", "a node", "a publisher",
                                                       "a subscriber", "a client", "a server"));
}

TEST(Reference, SaysOfEachKeyWhatMayStandThereAndWhatItMeans) {
  for (const auto& sections : {describe_configuration(), describe_workload()}) {
    for (const ReferenceSection& section : sections) {
      EXPECT_FALSE(section.keys.empty()) << section.title;
      for (const ReferenceKey& key : section.keys) {
        EXPECT_NE(key.value, "") << section.title << ": " << key.key;
        EXPECT_THAT(key.meaning, EndsWith(".")) << section.title << ": " << key.key;
      }
    }
  }
}

TEST(Reference, LeadsToSectionsThatExist) {
  for (const auto& sections : {describe_configuration(), describe_workload()}) {
    for (const ReferenceSection& section : sections) {
      for (const ReferenceKey& key : section.keys) {
        const std::size_t begin = key.value.find('[');
        if (begin == std::string::npos) continue;
        const std::size_t end = key.value.find(']');
        EXPECT_THAT(titles(sections), Contains(key.value.substr(begin + 1, end - begin - 1)));
      }
    }
  }
}

TEST(Reference, ListsValuesAsTheirReadersAcceptThem) {
  EXPECT_EQ(find("memory", "lock").value, "`true` or `false`");
  EXPECT_EQ(find("the file", "realtime").value, "`require`, `prefer`, `off`");
  EXPECT_EQ(find("the file", "cpu_dma_latency_us").value, "integer from 0");
  EXPECT_EQ(find("the file", "threads").value, "map, each [a thread](#a-thread)");
  EXPECT_EQ(find("the file", "containers").value, "list, each [a container](#a-container)");
  EXPECT_EQ(find("the file", "chains").value, "`auto`, or list, each [a chain](#a-chain)");
  EXPECT_EQ(find("dds", "domain").value, "integer, 0 to 230");
  EXPECT_EQ(find("a thread", "priority").value, "integer, or a band such as `60..68`");
  EXPECT_EQ(find("a thread", "runtime").value, "duration");
  EXPECT_EQ(find("a thread", "affinity").value, "list, each integer from 0");
  EXPECT_EQ(find("an executor", "trigger").value, "`any`, `all`, or [a trigger](#a-trigger)");
  EXPECT_EQ(find("a component", "remap").value, "map, each text");
}

TEST(Reference, ListsTheDefaultsOfTheCode) {
  EXPECT_EQ(find("the file", "realtime").default_value, "`prefer`");
  EXPECT_EQ(find("memory", "lock").default_value, "`false`");
  EXPECT_EQ(find("a thread", "policy").default_value, "`SCHED_OTHER`");
  EXPECT_EQ(find("a thread", "priority").default_value, "0");
  EXPECT_EQ(find("an executor", "type").default_value, "`single_threaded`");
  EXPECT_EQ(find("a restart", "delay").default_value, "`1s`");
  for (const auto& [title, key] : {std::pair{"the file", "cpu_dma_latency_us"},
                                   {"a thread", "runtime"},
                                   {"a component", "name"},
                                   {"a component", "log_level"},
                                   {"a callback group", "priority"}}) {
    EXPECT_EQ(find(title, key).default_value, "") << key;
  }
}

TEST(Reference, MarksTheRequiredKeys) {
  EXPECT_TRUE(find("a component", "component").is_required);
  EXPECT_FALSE(find("a component", "name").is_required);
}

TEST(Reference, DoesNotDependOnTheEnvironment) {
  setenv("ROS_DOMAIN_ID", "7", 1);
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", 1);
  EXPECT_EQ(find("dds", "domain").default_value, "");
  EXPECT_EQ(find("dds", "discovery").default_value, "");
  unsetenv("ROS_AUTOMATIC_DISCOVERY_RANGE");
  unsetenv("ROS_DOMAIN_ID");
}

TEST(Reference, DoesNotListRemovedKeys) {
  for (const ReferenceSection& section : describe_configuration()) {
    for (const ReferenceKey& key : section.keys) {
      for (const Removed& removed : kRemoved) {
        EXPECT_FALSE(removed.from == section.title && removed.name == key.key) << key.key;
      }
    }
  }
}

}  // namespace
}  // namespace takt
