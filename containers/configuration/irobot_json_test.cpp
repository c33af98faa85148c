// Tests of workloads in the iRobot format.
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"

namespace takt {
namespace {

using testing::IsEmpty;
using testing::StartsWith;

using Texts = std::vector<std::string>;
using Numbers = std::vector<std::int64_t>;

class Workload : public testing::Test {
 protected:
  static void SetUpTestSuite() { provide_workload(); }

  static SystemDescription read(const std::string& text) {
    return ConfigurationFile("robot.json", text).read();
  }
  static std::string errors_in(const std::string& text) {
    return ConfigurationFile("robot.json", text).errors();
  }
  // The errors of a node "a" with these further keys, which begin in line 2.
  static std::string errors_of_node(const std::string& keys) {
    return errors_in("{\"nodes\": [{\"node_name\": \"a\",\n" + keys + "}]}");
  }
  // The errors of a publisher that is right but for these keys, which begin in line 2.
  static std::string errors_of_publisher(const std::string& keys) {
    return errors_of_node("\"publishers\": [{\"topic_name\": \"t\", " + keys + "}]");
  }
};

TEST_F(Workload, BecomesComponentsWithParallelArrays) {
  const ConfigurationFile file("robot.json", R"({"nodes": [
  {"node_name": "lyon", "node_namespace": "/city", "executor_id": 3,
   "publishers": [
     {"topic_name": "tigris", "msg_type": "stamped4_float32", "period_ms": 10},
     {"topic_name": "/nile", "msg_type": "plugin::stamped_vector", "msg_size": 7, "freq_hz": 3,
      "msg_pass_by": "loaned_msg", "qos_depth": 2, "qos_reliability": "best_effort",
      "qos_durability": "transient_local"}],
   "subscribers": [
     {"topic_name": "amazon", "msg_type": "stamped1kb"},
     {"topic_name": "parana", "msg_type": "stamped1kb", "msg_pass_by": "unique_ptr",
      "qos_depth": 1, "qos_reliability": "system_default"}]},
  {"node_name": "idle"}]})");
  const SystemDescription system = file.read();
  EXPECT_EQ(system.file, file.path());
  EXPECT_EQ(system.name, "robot");
  EXPECT_THAT(system.notes, IsEmpty());
  ASSERT_EQ(system.components.size(), 2U);
  const ComponentDescription& lyon = system.components[0];
  EXPECT_EQ(lyon.type, "takt::Workload");
  EXPECT_EQ(lyon.name, "lyon");
  EXPECT_EQ(lyon.name_space, "/city");
  EXPECT_EQ(lyon.executor, "executor_3");
  EXPECT_EQ(lyon.where, file.path() + ":2");
  const Parameters expected{
      {"publishers.topic", Texts{"tigris", "/nile"}},
      {"publishers.size_bytes", Numbers{16, 7}},
      {"publishers.period_us", Numbers{10000, 333333}},
      {"publishers.pass_by", Texts{"unique_ptr", "loaned_msg"}},
      {"publishers.depth", Numbers{10, 2}},
      {"publishers.reliability", Texts{"reliable", "best_effort"}},
      {"publishers.durability", Texts{"volatile", "transient_local"}},
      {"subscriptions.topic", Texts{"amazon", "parana"}},
      {"subscriptions.depth", Numbers{10, 1}},
      {"subscriptions.reliability", Texts{"reliable", "reliable"}},
      {"subscriptions.durability", Texts{"volatile", "volatile"}},
      {"subscriptions.pass_by", Texts{"shared_ptr", "unique_ptr"}},
  };
  EXPECT_EQ(lyon.parameters, expected);
  EXPECT_EQ(lyon.parameter_lines.at("subscriptions.topic"), file.path() + ":9");
  EXPECT_THAT(system.components[1].parameters, IsEmpty());
  EXPECT_EQ(system.components[1].executor, "executor_0");
}

TEST_F(Workload, HasAnExecutorForEachId) {
  const SystemDescription system = read(
      R"({"nodes": [{"node_name": "a", "executor_id": 2}, {"node_name": "b"},
                    {"node_name": "c", "executor_id": 2}]})");
  ASSERT_EQ(system.executors.size(), 2U);
  EXPECT_EQ(system.executors[0].name, "executor_2");
  EXPECT_EQ(system.executors[0].type, "single_threaded");
  EXPECT_EQ(system.executors[1].name, "executor_0");
}

TEST_F(Workload, CopiesNodesByNumber) {
  const SystemDescription system =
      read(R"({"nodes": [{"node_name": "a", "node_namespace": "/s", "number": 2}]})");
  ASSERT_EQ(system.components.size(), 2U);
  EXPECT_EQ(system.components[0].name, "a_1");
  EXPECT_EQ(system.components[1].name, "a_2");
  EXPECT_EQ(system.components[1].name_space, "/s_2");
}

TEST_F(Workload, LetsTheFrequencyWinOverThePeriod) {
  const SystemDescription system = read(
      R"({"nodes": [{"node_name": "a", "publishers": [
        {"topic_name": "t", "msg_type": "stamped10b", "freq_hz": 100, "period_ms": 500},
        {"topic_name": "t", "msg_type": "stamped10b", "period_ms": 2.3},
        {"topic_name": "t", "msg_type": "stamped10b", "period_ms": 0.0019}]}]})");
  EXPECT_EQ(system.components.at(0).parameters.at("publishers.period_us"),
            ParameterValue(Numbers{10000, 2300, 1}));
}

TEST_F(Workload, AcceptsWhatChangesNothing) {
  EXPECT_EQ(errors_of_publisher(R"("msg_type": "stamped10b", "freq_hz": 1, "qos_depth": 10,
      "qos_history": "system_default", "qos_reliability": "reliable", "qos_durability": "volatile",
      "qos_deadline": "default", "qos_lifespan": "default", "qos_liveliness": "manual_by_topic",
      "qos_liveliness_lease_duration": "default",
      "qos_avoid_ros_namespace_conventions": "false")"),
            "no error\n");
}

TEST_F(Workload, ReadsClientsAndServers) {
  const SystemDescription system = read(R"({"nodes": [
    {"node_name": "a", "servers": [{"service_name": "s", "srv_type": "stamped10b"}]},
    {"node_name": "b", "number": 3, "clients": [
      {"service_name": "s", "srv_type": "plugin::stamped10b", "period_ms": 10}]}]})");
  ASSERT_EQ(system.components.size(), 4U);
  EXPECT_EQ(system.components[0].parameters.at("servers.service"), ParameterValue(Texts{"s"}));
  EXPECT_EQ(system.components[3].parameters.at("clients.service"), ParameterValue(Texts{"s"}));
  EXPECT_EQ(system.components[3].parameters.at("clients.period_us"),
            ParameterValue(Numbers{10000}));
}

// ---- Mistakes ----

TEST_F(Workload, NeedsNodes) {
  EXPECT_EQ(errors_in("{\n\"node\": []}"),
            "robot.json:1: the file needs the key 'nodes'; add it\n"
            "robot.json:2: 'node' is not a key of the file; did you mean 'nodes'? valid: nodes\n");
  EXPECT_EQ(errors_in("{\n\"nodes\": []}"),
            "robot.json:2: the list of nodes is empty; describe at least one\n");
  EXPECT_EQ(errors_in("[]"), "robot.json:1: the file is a list; write a map\n");
}

TEST_F(Workload, RefusesUnknownKeys) {
  EXPECT_EQ(errors_of_node("\"publisher\": []"),
            "robot.json:2: 'publisher' is not a key of a node; did you mean 'publishers'? valid: "
            "node_name, node_namespace, number, executor_id, publishers, subscribers, clients, "
            "servers\n");
  EXPECT_THAT(errors_of_publisher(R"("msg_type": "stamped10b", "freq_hz": 1,
      "qos_dept": 3)"),
              StartsWith("robot.json:3: 'qos_dept' is not a key of a publisher; did you mean "
                         "'qos_depth'? valid: topic_name, msg_type, "));
}

TEST_F(Workload, RefusesPublishersThatLackSomething) {
  EXPECT_EQ(errors_of_publisher("\"msg_type\": \"stamped10b\""),
            "robot.json:2: a publisher needs the key 'freq_hz' or 'period_ms'; add one of them\n");
  EXPECT_EQ(errors_of_publisher("\"freq_hz\": 1"),
            "robot.json:2: a publisher needs the key 'msg_type'; add it\n");
  EXPECT_EQ(errors_of_publisher("\"msg_type\": \"stamped_vector\", \"freq_hz\": 1"),
            "robot.json:2: a publisher of stamped_vector needs the key 'msg_size'; add it, in "
            "bytes\n");
}

TEST_F(Workload, RefusesValuesThatCannotBe) {
  EXPECT_THAT(errors_of_publisher("\"msg_type\": \"stamped11b\", \"freq_hz\": 1"),
              StartsWith("robot.json:2: 'msg_type' cannot be 'stamped11b'; did you mean "
                         "'stamped10b'? valid: stamped10b, stamped100b, "));
  EXPECT_EQ(errors_of_publisher("\"msg_type\": \"stamped10b\", \"freq_hz\": 0"),
            "robot.json:2: 'freq_hz' is 0; write a number that makes a period from 1 us to 24 h\n");
  EXPECT_EQ(errors_of_publisher("\"msg_type\": \"stamped10b\",\n\"period_ms\": \"10\""),
            "robot.json:3: 'period_ms' is '10'; write a number\n");
  EXPECT_EQ(errors_of_publisher("\"msg_type\": \"stamped10b\", \"freq_hz\": 1, \"msg_size\": 9"),
            "robot.json:2: stamped10b has a fixed size; remove 'msg_size', or choose "
            "stamped_vector\n");
  EXPECT_EQ(errors_of_publisher(
                "\"msg_type\": \"stamped10b\", \"freq_hz\": 1,\n\"msg_pass_by\": \"copy\""),
            "robot.json:3: 'msg_pass_by' cannot be 'copy'; valid: unique_ptr, shared_ptr, "
            "loaned_msg\n");
  EXPECT_THAT(errors_of_publisher("\"msg_type\": \"stamped10b\", \"freq_hz\": 1, \"qos_depth\": 0"),
              StartsWith("robot.json:2: a history of 0 messages cannot be kept; choose a depth "
                         "from 1 to "));
  EXPECT_EQ(errors_of_node("\"number\": 0"),
            "robot.json:2: 'number' is 0; write an integer from 1 to 100000\n");
}

TEST_F(Workload, RefusesQualitiesThatItDoesNotKnow) {
  EXPECT_EQ(errors_of_publisher(R"("msg_type": "stamped10b", "freq_hz": 1,
      "qos_history": "keep_all",
      "qos_durability": "transient",
      "qos_deadline": "1s")"),
            "robot.json:4: 'qos_durability' cannot be 'transient'; did you mean 'transient_local'? "
            "valid: volatile, transient_local, system_default\n"
            "robot.json:5: 'qos_deadline' cannot be '1s'; valid: default\n");
}

TEST_F(Workload, RefusesTopicsOfTwoTypes) {
  EXPECT_EQ(errors_in(R"({"nodes": [
    {"node_name": "a", "node_namespace": "/n", "subscribers": [
      {"topic_name": "t", "msg_type": "stamped10b"}]},
    {"node_name": "b", "subscribers": [
      {"topic_name": "t", "msg_type": "stamped1kb"},
      {"topic_name": "/n/t",
       "msg_type": "stamped4mb"}]}]})"),
            "robot.json:7: topic '/n/t' has type stamped10b in line 3, but stamped4mb here; give "
            "the topic one type\n");
}

TEST_F(Workload, RefusesNodesOfTheSameName) {
  EXPECT_EQ(errors_in("{\"nodes\": [{\"node_name\": \"a_2\"},\n"
                      "{\"node_name\": \"a\", \"number\": 2}]}"),
            "robot.json:2: the name '/a_2' is taken in line 1; give each component its own name or "
            "namespace\n");
}

TEST_F(Workload, RefusesServicesThatLackSomething) {
  EXPECT_EQ(errors_of_node("\"clients\": [{\"service_name\": \"s\", \"srv_type\": \"x\"}],\n"
                           "\"servers\": [{}]"),
            "robot.json:2: 'srv_type' cannot be 'x'; valid: stamped10b\n"
            "robot.json:2: a client needs the key 'freq_hz' or 'period_ms'; add one of them\n"
            "robot.json:3: a server needs the key 'service_name'; add it\n"
            "robot.json:3: a server needs the key 'srv_type'; add it\n");
}

TEST_F(Workload, DoesNotExplode) {
  EXPECT_EQ(errors_of_node("\"number\": 100000"),
            "robot.json:1: with all copies of nodes these are more than 100000 values; ask for "
            "fewer copies\n");
}

// ---- The samples ----

class Topology : public Workload {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kFolder)) GTEST_SKIP() << "there is no " << kFolder;
  }
  static std::size_t length(const ComponentDescription& component, const char* array) {
    const auto found = component.parameters.find(array);
    return found == component.parameters.end() ? 0 : std::get<Texts>(found->second).size();
  }

  const std::filesystem::path kFolder = std::string(TAKT_SHARED_DATA) + "/topologies";
};

TEST_F(Topology, SierraNevadaHas10Nodes13PublishersAnd17Subscriptions) {
  const SystemDescription system = read_system(kFolder / "sierra_nevada.json");
  EXPECT_EQ(system.name, "sierra_nevada");
  EXPECT_EQ(system.components.size(), 10U);
  EXPECT_EQ(system.executors.size(), 1U);
  std::size_t publishers = 0, subscriptions = 0;
  for (const ComponentDescription& component : system.components) {
    publishers += length(component, "publishers.topic");
    subscriptions += length(component, "subscriptions.topic");
  }
  EXPECT_EQ(publishers, 13U);
  EXPECT_EQ(subscriptions, 17U);
}

TEST_F(Topology, MontBlancHas20Nodes23PublishersAnd35Subscriptions) {
  const SystemDescription system = read_system(kFolder / "mont_blanc.json");
  EXPECT_EQ(system.components.size(), 20U);
  std::size_t publishers = 0, subscriptions = 0;
  for (const ComponentDescription& component : system.components) {
    publishers += length(component, "publishers.topic");
    subscriptions += length(component, "subscriptions.topic");
  }
  EXPECT_EQ(publishers, 23U);
  EXPECT_EQ(subscriptions, 35U);
}

TEST_F(Topology, SimpleArchitectureHasCopiesAndServices) {
  const SystemDescription system = read_system(kFolder / "simple_architecture.json");
  EXPECT_EQ(system.components.size(), 8U);
  EXPECT_EQ(system.components.back().name, "multi_node_5");
  EXPECT_THAT(system.notes, IsEmpty());
}

}  // namespace
}  // namespace takt
