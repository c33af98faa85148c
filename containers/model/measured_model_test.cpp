// Tests of reading a measured model, which a person may have edited.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/measured_model.hpp"

#include <chrono>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "takt/containers/configuration/configuration_file_test.hpp"

namespace takt::measured_model_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

constexpr const char* kComplete = R"(
file: robot.yaml
machine: 2 × AMD EPYC, Linux 6.18
duration: 10s
margin: 0.5
overheads: {dispatch: 1500ns, wake: {min: 9us, p50: 10us, p99: 20us, p99.9: 40us}}
lost_executions: 7
settings: {dds: "{}", /scan.depth: "2"}
callbacks:
  /lidar/tick:
    executions: 100
    execution: {min: 1ms, p50: 1100us, p99: 1200us, max: 1300us, first_ten: 1250us}
    arrival: {period: 10ms, jitter: 1ms, distances: [9ms, 19ms]}
    dropped: 3
    causes: {/fusion/points: 2}
  /fusion/points:
    executions: 200
    execution: {max: 1ms}
chains:
  sense_to_act: {instances: 100, p50: 2ms, p99: 3ms, p99.9: 4ms, max: 5ms}
)";

MeasuredModel model_in(const std::string& text) {
  return read_measured_model(ConfigurationFile("m.model.yaml", text).path());
}
/// All errors, without the folder of the file.
std::string errors_in(const std::string& text) {
  const ConfigurationFile file("m.model.yaml", text);
  const std::size_t folder = file.path().size() - std::string("m.model.yaml").size();
  try {
    read_measured_model(file.path());
    return "no error";
  } catch (const ConfigurationError& error) {
    std::string result;
    for (const std::string& message : error.errors()) result += message.substr(folder) + "\n";
    return result;
  }
}
/// Of one callback with these keys, each in its line from the third on.
std::string errors_of(const std::string& keys) {
  return errors_in("callbacks:\n  /a/b:\n" + keys);
}

TEST(MeasuredModel, IsRead) {
  const MeasuredModel model = model_in(kComplete);
  EXPECT_EQ(model.file, "robot.yaml");
  EXPECT_EQ(model.machine, "2 × AMD EPYC, Linux 6.18");
  EXPECT_EQ(model.duration, 10s);
  EXPECT_EQ(model.margin, 0.5);
  EXPECT_EQ(model.dispatch_overhead.longest, 1500ns);
  EXPECT_FALSE(model.dispatch_overhead.are_distributed());
  EXPECT_EQ(model.wake_overhead.least, 9us);
  EXPECT_EQ(model.wake_overhead.median, 10us);
  EXPECT_EQ(model.wake_overhead.p99, 20us);
  EXPECT_EQ(model.wake_overhead.longest, 40us);
  EXPECT_EQ(model.lost_executions, 7u);
  EXPECT_THAT(model.settings, ElementsAre(Pair("/scan.depth", "2"), Pair("dds", "{}")));
  ASSERT_EQ(model.callbacks.size(), 2u);
  const MeasuredCallback& tick = model.callbacks[0];
  EXPECT_EQ(tick.name, "/lidar/tick");
  EXPECT_EQ(tick.executions, 100u);
  EXPECT_EQ(tick.least_execution, 1ms);
  EXPECT_EQ(tick.median_execution, 1100us);
  EXPECT_EQ(tick.p99_execution, 1200us);
  EXPECT_EQ(tick.longest_execution, 1300us);
  EXPECT_EQ(tick.longest_first_execution, 1250us);
  EXPECT_EQ(tick.period, 10ms);
  EXPECT_EQ(tick.jitter, 1ms);
  EXPECT_THAT(tick.least_distances, ElementsAre(9ms, 19ms));
  EXPECT_EQ(tick.dropped, 3u);
  EXPECT_THAT(tick.causes, ElementsAre(Pair("/fusion/points", 2)));
  EXPECT_EQ(model.callbacks[1].name, "/fusion/points");
  EXPECT_EQ(model.callbacks[1].executions, 200u);
  ASSERT_EQ(model.chains.size(), 1u);
  EXPECT_EQ(model.chains[0].name, "sense_to_act");
  EXPECT_EQ(model.chains[0].instances, 100u);
  EXPECT_EQ(model.chains[0].median, 2ms);
  EXPECT_EQ(model.chains[0].p99, 3ms);
  EXPECT_EQ(model.chains[0].p999, 4ms);
  EXPECT_EQ(model.chains[0].longest, 5ms);
}

TEST(MeasuredModel, NeedsOnlyCallbacks) {
  const MeasuredModel model = model_in("callbacks: {}");
  EXPECT_EQ(model.margin, 0.2);
  EXPECT_TRUE(model.callbacks.empty());
  EXPECT_EQ(errors_in("margin: 0.1"),
            "m.model.yaml:1: a measured model needs the key 'callbacks'; add it\n");
}

TEST(MeasuredModel, MayHaveWhatAPersonHasWritten) {
  EXPECT_EQ(errors_of("    execution: {max: 4ms}\n    arrival: {distances: [0s, 5ms]}"),
            "no error");
  EXPECT_EQ(errors_of("    execution: {min: 1ms, max: 4ms}\n    arrival: {period: 1s}"),
            "no error");
  EXPECT_EQ(errors_of("    arrival: {period: 10ms, jitter: 30ms, distances: [0s, 0s, 1ms]}"),
            "no error");
}

TEST(MeasuredModel, RefusesUnknownKeysWithTheNearestValidOne) {
  EXPECT_EQ(
      errors_in("callback: {}\ncallbacks: {}"),
      "m.model.yaml:1: 'callback' is not a key of a measured model; did you mean 'callbacks'? "
      "valid: file, machine, duration, total_duration, margin, lost_executions, overheads, "
      "executors, components, active_nodes, settings, callbacks, chains\n");
  EXPECT_THAT(errors_of("    arival: {}"), HasSubstr("m.model.yaml:3: 'arival' is not a key of a "
                                                     "measured callback; did you mean 'arrival'?"));
  EXPECT_THAT(errors_of("    arrival: {jiter: 1ms}"), HasSubstr("did you mean 'jitter'?"));
  EXPECT_THAT(errors_of("    execution: {mx: 1ms}"), HasSubstr("did you mean 'max'?"));
}

TEST(MeasuredModel, RefusesNamesThatAreNoCallbacks) {
  for (const char* name : {"tick", "/tick", "\"\""}) {
    EXPECT_THAT(errors_in(fmt::format("callbacks: {{{}: {{}}}}", name)),
                HasSubstr("write its node and its name, as in /camera/image"));
  }
  EXPECT_EQ(errors_of("    causes: {/a/B: 1}"),
            "m.model.yaml:3: '/a/B' is not a callback of this file; did you mean '/a/b'? valid: "
            "/a/b\n");
  EXPECT_EQ(errors_in("callbacks:\n  /a/b: {}\n  /a/b: {}"),
            "m.model.yaml:3: '/a/b' is already in line 2; remove one of them\n");
  EXPECT_EQ(errors_in("components: {/arm: 1f}\nactive_nodes: [/arn]\ncallbacks: {}"),
            "m.model.yaml:2: '/arn' is not one of the 'components' of this file; did you mean "
            "'/arm'? valid: /arm\n");
}

TEST(MeasuredModel, RefusesWhatIsNoNumber) {
  EXPECT_EQ(errors_of("    executions: -1"),
            "m.model.yaml:3: 'executions' is -1; write an integer from 0\n");
  EXPECT_EQ(errors_of("    dropped: 1.5"),
            "m.model.yaml:3: 'dropped' is 1.5; write an integer from 0\n");
  EXPECT_EQ(errors_of("    causes: {/a/b: many}"),
            "m.model.yaml:3: '/a/b' is 'many'; write an integer from 0\n");
  EXPECT_EQ(errors_of("    execution: {max: 5}"),
            "m.model.yaml:3: 'max' is 5; write a number and one of ns, us, ms, s, m, h, such as "
            "20ms\n");
  EXPECT_EQ(errors_of("    execution: {max: -5ms}"),
            "m.model.yaml:3: '-5ms' is not a duration; write a number and one of ns, us, ms, s, m, "
            "h, such as 20ms\n");
  EXPECT_EQ(errors_of("    arrival: {period: 10001h}"),
            "m.model.yaml:3: '10001h' is longer than 10000 h; write a time that can be measured\n");
  for (const char* margin : {"-0.1", "10.5", ".nan", ".inf", "true", "a fifth"}) {
    EXPECT_THAT(errors_in(fmt::format("margin: {}\ncallbacks: {{}}", margin)),
                HasSubstr("write a number from 0 to 10: 0.2 is a fifth"));
  }
}

TEST(MeasuredModel, RefusesExecutionTimesThatContradictEachOther) {
  EXPECT_EQ(errors_of("    execution: {min: 5ms, max: 4ms}"),
            "m.model.yaml:3: 'execution' contradicts itself: 'min' is longer than 'max'; correct "
            "it, or measure again\n");
  EXPECT_THAT(errors_of("    execution: {min: 1ms, p50: 3ms, p99: 2ms, max: 4ms}"),
              HasSubstr("'p50' is longer than 'p99'"));
  EXPECT_THAT(errors_of("    execution: {max: 4ms, first_ten: 5ms}"),
              HasSubstr("'first_ten' is longer than 'max'"));
  EXPECT_THAT(errors_of("    executions: 0\n    execution: {max: 4ms}"),
              HasSubstr("contradicts itself: it has 'execution' of 0 'executions'"));
  EXPECT_EQ(errors_of("    execution: {p50: 1ms}"),
            "m.model.yaml:3: an execution time needs the key 'max'; add it\n");
}

/// One file that contradicts itself, beside one that does not.
void expect_relation(const std::string& holds, const std::string& broken, int line,
                     const std::string& what) {
  EXPECT_EQ(errors_in(holds), "no error") << holds;
  EXPECT_EQ(errors_in(broken),
            fmt::format("m.model.yaml:{}: {}; correct it, or measure again\n", line, what))
      << broken;
}

// Each relation of one callback.
TEST(MeasuredModel, RefusesFiguresOfACallbackThatNoRunCanHaveShown) {
  const auto of_callback = [](const std::string& holds, const std::string& broken,
                              const std::string& what) {
    const std::string top = "duration: 1s\ncallbacks:\n  /a/b:\n    executions: 9\n    ";
    const char* const end = holds.starts_with("execution:") ? "" : "\n    execution: {max: 1ms}";
    expect_relation(top + holds + end, top + broken + end, 5, what);
  };
  of_callback("execution: {min: 2ms, max: 4ms, first_ten: 3ms}",
              "execution: {min: 2ms, max: 4ms, first_ten: 1ms}",
              "'execution' contradicts itself: 'min' is longer than 'first_ten'");
  of_callback("execution: {max: 900ms}", "execution: {max: 3s}",
              "'execution' contradicts itself: 'max' is longer than the run");
  of_callback("execution: {max: 1ms, waits: 900ms}", "execution: {max: 1ms, waits: 3s}",
              "'execution' contradicts itself: 'waits' is longer than the run");
  of_callback("arrival: {distances: [5ms, 10ms]}", "arrival: {distances: [5ms, 9ms]}",
              "'arrival' contradicts itself: distances[1] is 9ms, but it is made of distances[0] "
              "and distances[0], 10ms");
  of_callback("arrival: {distances: [1ms, 2ms, 3ms, 4ms, 5ms, 6ms, 7ms, 8ms]}",
              "arrival: {distances: [1ms, 2ms, 3ms, 4ms, 5ms, 6ms, 7ms, 8ms, 9ms]}",
              "'arrival' contradicts itself: there are 9 distances between 9 arrivals");
  of_callback(
      "arrival: {distances: [200ms]}", "arrival: {distances: [700ms]}",
      "'arrival' contradicts itself: 9 arrivals with distances[0] of 700ms take longer than "
      "the run");
  of_callback("arrival: {distances: [200ms, 400ms]}", "arrival: {distances: [200ms, 3s]}",
              "'arrival' contradicts itself: distances[1] is 3s, longer than the run");
  of_callback("uncaused: {executions: 9}", "uncaused: {executions: 10}",
              "'uncaused' contradicts itself: it has more executions than the callback");
  of_callback("uncaused: {executions: 2, distances: [1ms]}",
              "uncaused: {executions: 2, distances: [1ms, 2ms]}",
              "'uncaused' contradicts itself: there are 2 distances between 2 arrivals");
  of_callback("uncaused: {executions: 0}", "uncaused: {executions: 0, distances: [1ms]}",
              "'uncaused' contradicts itself: there are 1 distance between 0 arrivals");
  of_callback(
      "uncaused: {executions: 3, distances: [1ms, 2ms]}",
      "uncaused: {executions: 3, distances: [2ms, 1ms]}",
      "'uncaused' contradicts itself: 'distances' get shorter: each is for one arrival more "
      "than the one before");
}

// Each relation between the others.
TEST(MeasuredModel, RefusesFiguresOfAModelThatNoRunCanHaveShown) {
  const std::string arrivals = "arrival: {distances: [2ms]}\n    ";
  const std::string three = "{executions: 3, execution: {max: 1ms}}";
  const auto sender = [](int executions, int causes) {
    return fmt::format(
        "callbacks:\n  /a/b:\n    executions: {}\n    execution: {{max: 1ms}}\n    causes: {{/c/d: "
        "{}}}\n",
        executions, causes);
  };
  expect_relation(
      "callbacks:\n  /a/b:\n    " + arrivals +
          "execution: {max: 1ms}\n    executions: 9\n    uncaused: {executions: 3, "
          "distances: [2ms]}",
      "callbacks:\n  /a/b:\n    " + arrivals +
          "execution: {max: 1ms}\n    executions: 9\n    uncaused: {executions: 3, "
          "distances: [1ms]}",
      6, "'uncaused' contradicts itself: distances[0] is 1ms, but of all arrivals it is 2ms");
  expect_relation(
      sender(9, 3) + "  /c/d: " + three, sender(9, 4) + "  /c/d: " + three, 5,
      "'/c/d' contradicts itself: one execution has caused 4 of it, and of its 3 there are 3 "
      "that something has caused");
  expect_relation(sender(9, 1) + "  /c/d: " + three, sender(9, 0) + "  /c/d: " + three, 5,
                  "'/c/d' contradicts itself: it causes none");
  expect_relation(sender(3, 1) + "  /c/d:\n    executions: 3\n    execution: {max: 1ms}",
                  sender(2, 1) + "  /c/d:\n    executions: 3\n    execution: {max: 1ms}", 7,
                  "'executions' contradicts itself: others have caused 3 of them, but by their "
                  "'causes' no more than 2");
  expect_relation(
      "callbacks: {/a/b: " + three + "}\nchains:\n  c: {instances: 3, max: 1s}",
      "callbacks: {/a/b: " + three + "}\nchains:\n  c: {instances: 4, max: 1s}", 3,
      "'c' contradicts itself: 4 instances came through, and no callback was executed more "
      "than 3 times");
  expect_relation("duration: 1s\ncallbacks: {}\nchains: {c: {max: 1s}}",
                  "duration: 1s\ncallbacks: {}\nchains: {c: {max: 3s}}", 3,
                  "'c' contradicts itself: 'max' is longer than the run");
  expect_relation(
      "duration: 1s\ntotal_duration: 2s\ncallbacks: {}",
      "duration: 1s\ntotal_duration: 900ms\ncallbacks: {}", 2,
      "'total_duration' contradicts itself: 'duration' is longer than 'total_duration'");
  expect_relation(
      "duration: 1s\nlost_executions: 1000\ncallbacks: {}",
      "duration: 1s\nlost_executions: 9000000000\ncallbacks: {}", 2,
      "'lost_executions' contradicts itself: 9000000000 executions do not fit into the run");
  const std::string executor = "{type: events, scheduler: fifo, callbacks: [/a/b]}";
  const std::string callback = "callbacks: {/a/b: {}}\nexecutors:\n  e: " + executor;
  expect_relation(
      callback, callback + "\n  f: " + executor, 4,
      "'f' contradicts itself: '/a/b' is in the lists of two executors, or twice in one");
  const std::string run = "executors:\n  e: " + executor + "\ncallbacks:\n  /a/b: " + three;
  expect_relation(
      run, run + "\n  /c/d: " + three, 5,
      "'/c/d' contradicts itself: it was executed, and is in the list of no executor under "
      "'executors'");
  const std::string often =
      "callbacks: {/a/b: {executions: 150, execution: {max: 1ms}, arrival: {period: 20ms}}}\n";
  expect_relation(often + "duration: 100s", often + "duration: 100h", 2,
                  "'duration' contradicts itself: it is 360000 s, and by its 'period' and "
                  "'executions' no callback was active for longer than 3 s");
}

// What is not known is left out: 0 is no such word.
TEST(MeasuredModel, SaysZeroOnlyOfWhatMayBeZero) {
  const auto of_chain = [](const std::string& keys) {
    return errors_in("callbacks: {}\nchains: {c: {max: 5ms, " + keys + "}}");
  };
  EXPECT_THAT(errors_in("callbacks: {}\nchains: {c: {max: 0s}}"), HasSubstr("'max' is zero"));
  for (const char* key : {"p50", "p99", "p99.9"})
    EXPECT_THAT(of_chain(fmt::format("{}: 0ns", key)), HasSubstr("leave it out")) << key;
  EXPECT_THAT(of_chain("instances: 0"), HasSubstr("it has latencies of 0 'instances'"));
  EXPECT_THAT(errors_of("    execution: {max: 0s}"), HasSubstr("'max' is zero"));
  for (const char* key : {"min", "p50", "p99", "first_ten"}) {
    EXPECT_THAT(errors_of(fmt::format("    execution: {{max: 1ms, {}: 0ns}}", key)),
                HasSubstr("leave it out"))
        << key;
  }
  EXPECT_EQ(errors_of("    execution: {max: 1ms, waits: 0ns}"), "no error");
  EXPECT_THAT(errors_of("    arrival: {period: 0s}"), HasSubstr("leave it out"));
  EXPECT_EQ(errors_of("    arrival: {period: 1s, jitter: 0s}"), "no error");
  for (const char* key : {"duration", "total_duration"})
    EXPECT_THAT(errors_in(fmt::format("{}: 0s\ncallbacks: {{}}", key)), HasSubstr("leave it out"));
  for (const char* key : {"dispatch", "wake"}) {
    EXPECT_THAT(errors_in(fmt::format("overheads: {{{}: 0ns}}\ncallbacks: {{}}", key)),
                HasSubstr("leave it out"));
    EXPECT_THAT(
        errors_in(fmt::format("overheads: {{{}: {{min: 0ns, p99.9: 1us}}}}\ncallbacks: {{}}", key)),
        HasSubstr("leave it out"));
  }
  EXPECT_THAT(errors_of("    executions: 3"), HasSubstr("no 'execution' says how long they took"));
  for (const char* key : {"arrival: {period: 1s}", "uncaused: {executions: 0}", "causes: {}"})
    EXPECT_THAT(errors_of(fmt::format("    executions: 0\n    {}", key)),
                HasSubstr("of 0 'executions'"));
}

// A model of several runs has the executions of all.
TEST(MeasuredModel, CountsTheTimeOfAllRuns) {
  const std::string callback =
      "callbacks: {/a/b: {executions: 90, execution: {max: 1ms}, arrival: {distances: [100ms]}}}\n";
  EXPECT_THAT(errors_in("duration: 1s\n" + callback), HasSubstr("take longer than the run"));
  EXPECT_EQ(errors_in("duration: 1s\ntotal_duration: 9s\n" + callback), "no error");
}

// Each would allow fewer arrivals than the file itself reports.
TEST(MeasuredModel, RefusesArrivalsThatContradictEachOther) {
  EXPECT_THAT(errors_of("    arrival: {distances: [2ms, 1ms]}"), HasSubstr("get shorter"));
  EXPECT_THAT(errors_of("    arrival: {distances: [0s, 0s]}"), HasSubstr("are all zero"));
  EXPECT_THAT(errors_of("    arrival: {jitter: 1ms}"), HasSubstr("a 'jitter' needs a 'period'"));
  EXPECT_THAT(errors_of("    arrival: {period: 10ms, jitter: 1ms, distances: [9ms, 18ms]}"),
              HasSubstr("distances[1] is 18ms, but 'period' and 'jitter' allow no less than 19ms"));
  EXPECT_THAT(errors_of("    arrival: {period: 10ms, jitter: 1ms, distances: [11ms, 22ms]}"),
              HasSubstr("distances[1] is 22ms, but 'period' and 'jitter' allow no more than 21ms"));
}

TEST(MeasuredModel, EndsSoonWhateverTheFile) {
  std::string distances = "1ms";
  for (int i = 1; i < 64; ++i) distances += ", 1ms";
  EXPECT_EQ(errors_of("    arrival: {distances: [" + distances + "]}"),
            "m.model.yaml:3: there are 64 distances; write the first 63\n");
  std::string many = "callbacks:\n";
  for (int i = 0; i < 40'000; ++i) many += fmt::format("  /a/{}: {{causes: {{/b/x: 1}}}}\n", i);
  EXPECT_THAT(errors_in(many), HasSubstr("the file has more than 100000 values"));
  many.resize(many.size() / 2);
  many.resize(many.rfind('\n'));
  EXPECT_THAT(errors_in(many), HasSubstr("more errors follow"));
  EXPECT_THAT(errors_in(""), HasSubstr("the file is empty"));
  EXPECT_THAT(errors_in("[]"), HasSubstr("the file is a list; write a map"));
}

// A message that is kept for late subscriptions is written into DDS, where none was in the measured
// run. Where and when callbacks run, changes no execution.
TEST(MeasuredSettings, AreWhatMayChangeAnExecution) {
  const auto settings = [](const std::string& text) {
    return measured_settings(
        ConfigurationFile(
            "r.yaml", text + "container: {components: [{component: takt::Workload, name: x}]}\n")
            .read());
  };
  EXPECT_THAT(settings(R"(
realtime: prefer
cpu_dma_latency_us: 0
threads: {a: {policy: SCHED_FIFO, priority: 9, affinity: [0]}}
executors: {a: {type: events, scheduler: fixed_priority, threads: [a]}}
machine: {exclusive: true, overheads: {dispatch: 1us}}
dds: {discovery: 'off', shared_memory: 'off'}
topics: {/x: {durability: transient_local, depth: 2, delay: 1ms, must_match: true}}
)"),
              ElementsAre(Pair("/x.depth", "2"), Pair("/x.durability", "transient_local"),
                          Pair("cpu_dma_latency_us", "0"), Pair("dds", "{}"),
                          Pair("dds.shared_memory", "off")));
  EXPECT_THAT(settings(""), ElementsAre());
}

}  // namespace
}  // namespace takt::measured_model_test
