// Tests of the configuration file: what is read from it, and what each mistake is called.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"

namespace demo {

class Lidar : public takt::Node {
 public:
  explicit Lidar(const takt::NodeOptions& options) : Node("lidar", options) {}
};
class Controller : public takt::Node {
 public:
  explicit Controller(const takt::NodeOptions& options) : Node("controller", options) {}
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Lidar, "for tests")
TAKT_REGISTER_COMPONENT(demo::Controller, "for tests")

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Pair;
using testing::StartsWith;

SystemDescription read(const std::string& text) {
  return ConfigurationFile("robot.yaml", text).read();
}

std::string errors_in(const std::string& text) {
  return ConfigurationFile("robot.yaml", text).errors();
}

// The errors of a file that is right but for these lines, which come first.
std::string errors_of(const std::string& lines) {
  return errors_in(lines + "container: {components: [{component: demo::Lidar}]}\n");
}

// The errors of a component of this kind, whose further keys begin in line 4.
std::string errors_of_component(const std::string& lines) {
  return errors_in("container:\n  components:\n    - component: demo::Lidar\n" + lines);
}

// ---- What is read ----

constexpr const char* kDesign = R"(realtime: require
memory: {lock: true}
cpu_dma_latency_us: 0
threads:
  control: {policy: SCHED_FIFO, priority: 80, affinity: [0]}
  bulk:    {policy: SCHED_OTHER, nice: 5}
executors:
  fast: {type: chain_aware, threads: [control]}
  rest: {type: multi_threaded, scheduler: ros, threads: [bulk, bulk]}
containers:
  - name: robot
    components:
      - component: demo::Lidar
        name: lidar
        namespace: /front
        executor: rest
        parameters: {rate_hz: 10}
        remap: {scan: /scan}
      - component: demo::Controller
        name: controller
        executor: fast
        callback_groups:
          loop: {executor: fast, priority: 90, deadline: 800us}
)";

TEST(Configuration, OfTheDesignIsReadAsAWhole) {
  const ConfigurationFile file("robot.yaml", kDesign);
  const SystemDescription system = file.read();
  EXPECT_EQ(system.file, file.path());
  EXPECT_EQ(system.name, "robot");
  EXPECT_EQ(system.realtime, Realtime::require);
  EXPECT_TRUE(system.lock_memory);
  EXPECT_EQ(system.cpu_dma_latency_us, 0);
  EXPECT_TRUE(system.notes.empty());

  ASSERT_EQ(system.threads.size(), 2U);
  const ThreadAttributes& control = system.threads[0].attributes;
  EXPECT_EQ(control.name, "control");
  EXPECT_EQ(control.policy, ThreadPolicy::fifo);
  EXPECT_EQ(control.priority, 80);
  EXPECT_THAT(control.affinity, ElementsAre(0));
  EXPECT_EQ(system.threads[0].where, file.path() + ":5");
  EXPECT_EQ(system.threads[1].attributes.name, "bulk");
  EXPECT_EQ(system.threads[1].attributes.nice, 5);

  ASSERT_EQ(system.executors.size(), 2U);
  const ExecutorDescription& rest = system.executors[1];
  EXPECT_EQ(rest.name, "rest");
  EXPECT_EQ(rest.type, "multi_threaded");
  EXPECT_EQ(rest.scheduler, "ros");
  EXPECT_THAT(rest.threads, ElementsAre("bulk", "bulk"));
  EXPECT_EQ(rest.where, file.path() + ":9");
}

TEST(Configuration, OfTheDesignDescribesItsComponents) {
  const ConfigurationFile file("robot.yaml", kDesign);
  const SystemDescription system = file.read();
  ASSERT_EQ(system.components.size(), 2U);
  const ComponentDescription& lidar = system.components[0];
  EXPECT_EQ(lidar.type, "demo::Lidar");
  EXPECT_EQ(lidar.name, "lidar");
  EXPECT_EQ(lidar.name_space, "/front");
  EXPECT_EQ(lidar.executor, "rest");
  EXPECT_THAT(lidar.parameters, ElementsAre(Pair("rate_hz", ParameterValue(std::int64_t{10}))));
  EXPECT_THAT(lidar.parameter_lines, ElementsAre(Pair("rate_hz", file.path() + ":17")));
  EXPECT_THAT(lidar.remap, ElementsAre(Pair("scan", "/scan")));
  EXPECT_THAT(lidar.remap_lines, ElementsAre(Pair("scan", file.path() + ":18")));
  EXPECT_EQ(lidar.where, file.path() + ":13");

  const CallbackGroupDescription& loop = system.components[1].callback_groups.at("loop");
  EXPECT_EQ(loop.executor, "fast");
  EXPECT_EQ(loop.parameters.priority, 90);
  EXPECT_EQ(loop.parameters.deadline, 800us);
  EXPECT_EQ(loop.where, file.path() + ":23");
}

TEST(Configuration, NeedsNoMoreThanOneComponent) {
  const SystemDescription system = read("container: {components: [{component: demo::Lidar}]}");
  EXPECT_EQ(system.name, "takt");
  EXPECT_EQ(system.realtime, Realtime::prefer);
  EXPECT_FALSE(system.lock_memory);
  EXPECT_EQ(system.cpu_dma_latency_us, std::nullopt);
  ASSERT_EQ(system.components.size(), 1U);
  EXPECT_EQ(system.components[0].name, "");
  EXPECT_EQ(system.components[0].executor, "");
}

TEST(Configuration, TypesParametersByTheCoreRulesOfYaml) {
  const SystemDescription system = read(R"(container:
  components:
    - component: demo::Lidar
      parameters:
        plain: {yes: "yes", on: true, off: FALSE, text: hello}
        numbers: {decimal: -7, hexadecimal: 0x1f, plus: +3, half: .5, large: 1e3}
        quoted: ["5", 'true']
        tagged: !!str 5
        lists: {flags: [true, false], counts: [1, 2], mixed: [1, 2.5], words: [a, b]}
        deep.er: {and: {deeper: 1us}}
)");
  using Words = std::vector<std::string>;
  EXPECT_THAT(
      system.components.at(0).parameters,
      ElementsAre(
          Pair("deep.er.and.deeper", ParameterValue("1us")),
          Pair("lists.counts", ParameterValue(std::vector<std::int64_t>{1, 2})),
          Pair("lists.flags", ParameterValue(std::vector<bool>{true, false})),
          Pair("lists.mixed", ParameterValue(std::vector<double>{1, 2.5})),
          Pair("lists.words", ParameterValue(Words{"a", "b"})),
          Pair("numbers.decimal", ParameterValue(std::int64_t{-7})),
          Pair("numbers.half", ParameterValue(0.5)),
          Pair("numbers.hexadecimal", ParameterValue(std::int64_t{31})),
          Pair("numbers.large", ParameterValue(1000.0)),
          Pair("numbers.plus", ParameterValue(std::int64_t{3})),
          Pair("plain.off", ParameterValue(false)), Pair("plain.on", ParameterValue(true)),
          Pair("plain.text", ParameterValue("hello")), Pair("plain.yes", ParameterValue("yes")),
          Pair("quoted", ParameterValue(Words{"5", "true"})), Pair("tagged", ParameterValue("5"))));
}

TEST(Configuration, MayUseAliases) {
  const ConfigurationFile file("robot.yaml", R"(container:
  components:
    - component: demo::Lidar
      parameters: &common {rate_hz: 10}
    - component: demo::Controller
      parameters: *common
)");
  const SystemDescription system = file.read();
  EXPECT_EQ(system.components.at(1).parameters, system.components.at(0).parameters);
  EXPECT_EQ(system.components.at(1).parameter_lines.at("rate_hz"), file.path() + ":4");
}

TEST(Configuration, NamesExecutorsAndThreadsBelowTheirUseToo) {
  EXPECT_EQ(errors_in(R"(container: {components: [{component: demo::Lidar, executor: fast}]}
executors: {fast: {threads: [control]}}
threads: {control: {}}
)"),
            "no error\n");
}

TEST(Configuration, KnowsTheDefaultExecutor) {
  EXPECT_EQ(errors_of_component("      executor: default\n"), "no error\n");
}

// ---- Mistakes in keys and types ----

TEST(Configuration, RefusesUnknownKeysWithTheNearestOne) {
  EXPECT_EQ(errors_of("realtme: off\n"),
            "robot.yaml:1: 'realtme' is not a key of the file; did you mean 'realtime'? valid: "
            "realtime, memory, cpu_dma_latency_us, threads, dds, topics, schedulers, "
            "wait_backends, executors, nodes, container, containers, lifecycle, machine, model, "
            "analysis, accept, priorities, "
            "chains, modes\n");
  EXPECT_EQ(errors_of("threads:\n  control:\n    prioritty: 5\n"),
            "robot.yaml:3: 'prioritty' is not a key of a thread; did you mean 'priority'? valid: "
            "policy, priority, nice, affinity, runtime, deadline, period\n");
}

TEST(Configuration, RefusesARemovedKeyWithItsReplacement) {
  EXPECT_EQ(errors_of("dds:\n  loopback_only: true\n"),
            "robot.yaml:2: 'loopback_only' was removed from dds; write `discovery: localhost` for "
            "true, `subnet` for false\n");
}

TEST(Configuration, DecidesTheQosOfTopics) {
  const SystemDescription system = read(
      "topics:\n"
      "  /scan: {profile: sensor_data, depth: 2, deadline: 10ms, lease_duration: 1s}\n"
      "  /map: {durability: transient_local, history: keep_all, depth: 3, lifespan: 2s}\n"
      "  /odom: {reliability: best_effort, liveliness: manual_by_topic, must_match: true}\n"
      "container: {components: [{component: demo::Lidar}]}\n");
  const QoS code = QoS(7);
  EXPECT_EQ(system.topics.at("/scan").over(code),
            QoS(2).best_effort().deadline(10ms).liveliness_lease_duration(1s));
  EXPECT_EQ(system.topics.at("/map").over(code), QoS().keep_all().transient_local().lifespan(2s));
  EXPECT_EQ(system.topics.at("/odom").over(code),
            QoS(7).best_effort().liveliness(Liveliness::manual_by_topic));
  EXPECT_THAT(system.topic_lines.at("/map"), EndsWith("robot.yaml:3"));
  EXPECT_EQ(system.must_match.size(), 1u);
  EXPECT_THAT(system.must_match.at("/odom"), EndsWith("robot.yaml:4"));
}

TEST(Configuration, ReadsTheRangeOfDiscovery) {
  EXPECT_EQ(read("dds: {discovery: lo}\ncontainer: {components: [{component: demo::Lidar, name: "
                 "lidar}]}\n")
                .dds->discovery,
            DiscoveryRange::lo);
}

TEST(Configuration, SaysWhatHappensWhenSomethingFails) {
  const SystemDescription system = read(
      "containers:\n"
      "- name: a\n"
      "  restart: on_failure\n"
      "  components:\n"
      "  - {component: demo::Lidar, name: lidar, on_exception: remove_node, log_level: warn}\n"
      "- name: b\n"
      "  restart: {policy: always, delay: 5ms, most: 2}\n"
      "  components:\n"
      "  - {component: demo::Lidar, name: other, namespace: rear}\n"
      "lifecycle:\n"
      "  bring_up: [lidar, rear/other]\n"
      "  depends_on: {rear/other: [lidar]}\n"
      "  heartbeat: 300ms\n"
      "  on_loss: shutdown\n");
  EXPECT_EQ(system.components[0].on_exception, OnException::remove_node);
  EXPECT_EQ(system.components[0].log_level, LogLevel::warn);
  EXPECT_EQ(system.components[1].on_exception, OnException::terminate);
  EXPECT_EQ(system.components[1].log_level, std::nullopt);
  EXPECT_EQ(system.restarts.at("a").policy, RestartOptions::Policy::on_failure);
  EXPECT_EQ(system.restarts.at("b").policy, RestartOptions::Policy::always);
  EXPECT_EQ(system.restarts.at("b").delay, 5ms);
  EXPECT_EQ(system.restarts.at("b").most, 2);
  ASSERT_TRUE(system.lifecycle);
  ASSERT_EQ(system.lifecycle->bring_up.size(), 2u);
  EXPECT_EQ(system.lifecycle->bring_up[1].name, "/rear/other");
  EXPECT_THAT(system.lifecycle->bring_up[1].depends_on, ElementsAre("/lidar"));
  EXPECT_EQ(system.lifecycle->heartbeat, 300ms);
  EXPECT_EQ(system.lifecycle->on_loss, LifecycleDescription::OnLoss::shutdown);
  EXPECT_EQ(split(system, Composition::file)[1].lifecycle->manager, "a");
  EXPECT_EQ(split(system, Composition::per_node)[1].lifecycle->manager, "lidar");
}

TEST(Configuration, RefusesKeysThatStandTwice) {
  EXPECT_EQ(errors_of("threads:\n  a: {}\n  b: {}\n  a: {}\n"),
            "robot.yaml:4: 'a' is already in line 2; remove one of them\n");
}

TEST(Configuration, RefusesValuesOfTheWrongType) {
  EXPECT_EQ(errors_of("memory: {lock: yes}\n"),
            "robot.yaml:1: 'lock' is 'yes'; write true or false\n");
  EXPECT_EQ(errors_of("cpu_dma_latency_us: 1.5\n"),
            "robot.yaml:1: 'cpu_dma_latency_us' is 1.5; write an integer\n");
  EXPECT_EQ(errors_of("cpu_dma_latency_us: -1\n"),
            "robot.yaml:1: 'cpu_dma_latency_us' is -1; write an integer from 0 to 2147483647\n");
  EXPECT_EQ(errors_of("threads: [control]\n"), "robot.yaml:1: 'threads' is a list; write a map\n");
  EXPECT_EQ(errors_of("threads:\n  control:\n"), "robot.yaml:2: 'control' is empty; write a map\n");
  EXPECT_EQ(errors_of("executors: {a: {threads: main}}\n"),
            "robot.yaml:1: 'threads' is 'main'; write a list\n");
  EXPECT_EQ(errors_of_component("      name: 5\n"),
            "robot.yaml:4: 'name' is 5; write a text, in quotes if it looks like a number\n");
  EXPECT_EQ(errors_in("- a\n"), "robot.yaml:1: the file is a list; write a map\n");
}

TEST(Configuration, RefusesWordsThatAreNoChoice) {
  EXPECT_EQ(errors_of("realtime: of\n"),
            "robot.yaml:1: 'realtime' cannot be 'of'; did you mean 'off'? valid: require, prefer, "
            "off\n");
  EXPECT_EQ(errors_of("realtime: true\n"),
            "robot.yaml:1: 'realtime' is true; write one of require, prefer, off\n");
}

TEST(Configuration, CollectsAllErrorsInTheOrderOfTheLines) {
  EXPECT_EQ(errors_in("container:\n  components: []\nthreads:\n  a: {priority: 5}\nrealtime: 1\n"),
            "robot.yaml:2: the container 'takt' is empty; list at least one component\n"
            "robot.yaml:4: priority 5 means nothing for SCHED_OTHER; leave it out, or choose "
            "SCHED_FIFO or SCHED_RR\n"
            "robot.yaml:5: 'realtime' is 1; write one of require, prefer, off\n");
}

TEST(Configuration, GivesUpAfterAHundredErrors) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "key" + std::to_string(i) + ": 1\n";
  const std::string errors = errors_of(text);
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 101);
  EXPECT_THAT(errors, EndsWith("robot.yaml:100: more errors follow; fix these first\n"));
}

// ---- Processes ----

SystemDescription three_in_two_containers() {
  SystemDescription system;
  system.name = "front";
  system.executors = {{.name = "fast"}, {.name = "slow"}};
  system.components = {{.container = "front", .name = "a", .executor = "fast"},
                       {.container = "back", .name = "b", .executor = "slow"},
                       {.container = "front", .name = "c"}};
  system.notes = {"note"};
  return system;
}

std::string summary(const std::vector<SystemDescription>& processes) {
  std::string text;
  for (const SystemDescription& process : processes) {
    text += process.name + ":";
    for (const auto& component : process.components) text += " " + component.name;
    text += " |";
    for (const auto& executor : process.executors) text += " " + executor.name;
    text += process.dds ? " on DDS\n" : "\n";
  }
  return text;
}

TEST(Split, GivesEachProcessItsComponentsAndTheExecutorsTheyUse) {
  const SystemDescription system = three_in_two_containers();
  EXPECT_EQ(summary(split(system, Composition::file)),
            "front: a c | fast on DDS\n"
            "back: b | slow on DDS\n");
  EXPECT_EQ(summary(split(system, Composition::single)), "front: a b c | fast slow\n");
  EXPECT_EQ(summary(split(system, Composition::per_node)),
            "a: a | fast on DDS\n"
            "b: b | slow on DDS\n"
            "c: c | on DDS\n");
}

// ---- Mistakes in containers and components ----

TEST(Configuration, NeedsOneContainer) {
  EXPECT_EQ(errors_in("realtime: off\n"),
            "robot.yaml:1: the file describes no container; add the key 'containers' with a list "
            "of components\n");
  EXPECT_EQ(errors_in("containers: []\n"),
            "robot.yaml:1: the list of containers is empty; add a container\n");
  EXPECT_EQ(errors_in("container:\n"), "robot.yaml:1: 'container' is empty; write a map\n");
  EXPECT_EQ(errors_in("containers:\n  - components: [{component: demo::Lidar}]\n"
                      "  - components: [{component: demo::Lidar}]\n"),
            "robot.yaml:3: the container in line 2 has the name 'takt', too; give each "
            "container its own 'name'\n");
  EXPECT_EQ(errors_of("containers: [{components: [{component: demo::Controller}]}]\n"),
            "robot.yaml:2: the file has both 'container' and 'containers'; remove one of "
            "them\n");
}

TEST(Configuration, ChecksWhatIsSaidOfDds) {
  EXPECT_EQ(errors_of("dds: {domain: 300, threads: urgnt}\nthreads: {urgent: {}}\n"),
            "robot.yaml:1: 'domain' is 300; write an integer from 0 to 230\n"
            "robot.yaml:1: no thread is called 'urgnt'; did you mean 'urgent'? valid: urgent\n");
  EXPECT_EQ(errors_of("threads: {a: {policy: SCHED_DEADLINE, runtime: 2ms, period: 10ms}}\n"
                      "dds:\n  threads: a\n"),
            "robot.yaml:3: the threads of DDS inherit their policy, and a reservation is not "
            "inherited; choose another policy than SCHED_DEADLINE for them\n");
}

TEST(Configuration, RefusesEmptyContainers) {
  EXPECT_EQ(errors_in("container:\n  name: robot\n  components: []\n"),
            "robot.yaml:3: the container 'robot' is empty; list at least one component\n");
  EXPECT_EQ(errors_in("container:\n  name: robot\n"),
            "robot.yaml:1: a container needs the key 'components'; add it\n");
}

TEST(Configuration, RefusesUnknownComponents) {
  EXPECT_THAT(errors_in("container:\n  components:\n    - component: demo::Lidr\n"),
              StartsWith("robot.yaml:3: no component is called 'demo::Lidr'; did you mean "
                         "'demo::Lidar'? valid: demo::Controller, demo::Lidar"));
  EXPECT_EQ(errors_in("container:\n  components:\n    - name: lidar\n"),
            "robot.yaml:3: a component needs the key 'component'; add it\n");
}

TEST(Configuration, RefusesNamesThatROSWouldRefuse) {
  EXPECT_EQ(errors_of_component("      name: my lidar\n      namespace: /a//b\n"
                                "      remap: {scan: 'a b'}\n"),
            "robot.yaml:4: 'my lidar' cannot be the name of a node; use letters, digits and '_', "
            "not beginning with a digit\n"
            "robot.yaml:5: '/a//b' cannot be the name of a namespace; use letters, digits and '_' "
            "between slashes: '/front/scan'\n"
            "robot.yaml:6: '/a b' cannot be the name of a topic; use letters, digits and '_' "
            "between slashes: '/front/scan'\n");
}

TEST(Configuration, RefusesComponentsOfTheSameFullName) {
  EXPECT_EQ(errors_in(R"(container:
  components:
    - {component: demo::Lidar, name: lidar, namespace: front}
    - {component: demo::Lidar, name: lidar}
    - {component: demo::Lidar, name: lidar, namespace: /front}
)"),
            "robot.yaml:5: the name '/front/lidar' is taken in line 3; give each component its "
            "own name or namespace\n");
}

TEST(Configuration, RefusesExecutorsOfComponentsThatDoNotExist) {
  EXPECT_EQ(errors_of_component("      executor: fats\nexecutors: {fast: {}}\n"),
            "robot.yaml:4: no executor is called 'fats'; did you mean 'fast'? valid: default, "
            "fast\n");
  EXPECT_EQ(errors_of_component("      callback_groups:\n        loop: {executor: slow}\n"),
            "robot.yaml:5: no executor is called 'slow'; valid: default\n");
}

TEST(Configuration, RefusesDurationsWithoutUnit) {
  EXPECT_EQ(errors_of_component("      callback_groups:\n        loop: {deadline: 800}\n"),
            "robot.yaml:5: 'deadline' is 800; write a number and one of ns, us, ms, s, m, h, such "
            "as 20ms\n");
  EXPECT_EQ(errors_of_component("      callback_groups:\n        loop: {deadline: 8 days}\n"),
            "robot.yaml:5: '8 days' has the unknown unit ' days'; write a number and one of ns, "
            "us, ms, s, m, h, such as 20ms\n");
  EXPECT_EQ(
      errors_of_component("      callback_groups:\n        loop: {deadline: 0s}\n"),
      "robot.yaml:5: a deadline of 0s cannot be kept; leave it out, or give a positive one\n");
}

TEST(Configuration, RefusesParametersWithoutAType) {
  EXPECT_EQ(errors_of_component("      parameters:\n        a:\n        b: []\n        c: [1, x]\n"
                                "        d: [[1]]\n        e.f: 1\n        e: {f: 2}\n"
                                "        g: 99999999999999999999\n"),
            "robot.yaml:5: 'a' is empty; write a value, or leave it out\n"
            "robot.yaml:7: 'c' is a list; write items of one type: numbers, texts, or true and "
            "false\n"
            "robot.yaml:8: 'd' is a list; write items of one type: numbers, texts, or true and "
            "false\n"
            "robot.yaml:10: the parameter 'e.f' has two values; remove one of them\n"
            "robot.yaml:11: the number 99999999999999999999 cannot be held; write a smaller one, "
            "or put it in quotes if it is a text\n");
}

}  // namespace
}  // namespace takt
