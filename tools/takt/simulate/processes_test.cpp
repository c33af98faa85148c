// Simulations of several processes: messages take their time between them, and bounds hold.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/simulation/scenario_search.hpp"
#include "takt/containers/simulation/simulation.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/run.hpp"
#include "takt/testing/random_system.hpp"

#include "analyze/analyzed_file.hpp"
#include "random/random_system.hpp"
#include "simulate/replay.hpp"
#include "yaml_file.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using nlohmann::ordered_json;
using ::testing::Contains;
using ::testing::HasSubstr;

SystemDescription of_processes(std::string_view text) {
  return ConfigurationFile("system.yaml", std::string(text)).read();
}

Simulation simulation_of(const SystemDescription& system, Nanoseconds duration = 1s) {
  return Simulation(system, {.overrides = {}, .measured = {}, .duration = duration});
}

/// The bounds of the chains that go through both processes.
std::map<std::string, Nanoseconds> bounds_between(const SystemDescription& system) {
  const AnalyzedFile file = analyze_system(system, {.machine = MachineFacts{}});
  std::map<const Node*, std::string> process_of;
  for (const ModelledProcess& process : file.processes) {
    for (const auto& member : process.nodes) process_of[member.node.get()] = process.name;
  }
  std::map<std::string, Nanoseconds> result;
  for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
    const auto& path = file.chains[i].path;
    const bool crosses = std::any_of(path.begin(), path.end(), [&](const Chain::Step& step) {
      return process_of[step.first.get()] != process_of[path.front().first.get()];
    });
    const auto bound = file.bounds.chains[i].bound;
    if (crosses && bound) result[file.model.chains[i].name] = *bound;
  }
  return result;
}

constexpr std::string_view kMachine =
    "machine: {cpus: 2, rt_runtime: 950ms, exclusive: true, overheads: {dispatch: 5us, wake: 20us, "
    "switch: 3us}}\n";

ordered_json random_document(std::uint64_t seed, const std::vector<std::string>& types,
                             const std::vector<std::string>& orders) {
  const RandomOptions options{
      .seed = seed, .executors = types, .schedulers = orders, .cpus = {0, 1}};
  return random_system(options).document;
}

/// The document with two containers instead of one; false: one would be empty.
template <class IsOfSecond>
bool divide(ordered_json& document, IsOfSecond is_of_second) {
  ordered_json processes = {{{"name", "one"}}, {{"name", "two"}}};
  for (const ordered_json& component : document["container"]["components"])
    processes[is_of_second(component) ? 1 : 0]["components"].push_back(component);
  document.erase("container");
  document["containers"] = processes;
  return processes[0].contains("components") && processes[1].contains("components");
}

/// A random system in two processes: whole executors of it, or parts of each.
std::string random_file_of_two(std::uint64_t seed) {
  ordered_json document = random_document(seed, executors_to_draw(), schedulers().names());
  std::mt19937_64 draws(seed);
  ordered_json topics;
  for (const ordered_json& component : document["container"]["components"]) {
    for (const auto& [key, entity] : component["parameters"].items()) {
      const char* const output = key == "publishers" ? "topic" : "output";
      if (key == "subscriptions") continue;
      const std::uint64_t least = draws() % 300;
      topics["/" + entity[output][0].get<std::string>()]["delay"] = {
          {"min", fmt::format("{}us", least)},
          {"max", fmt::format("{}us", least + draws() % 3000)}};
    }
  }
  document["topics"] = topics;
  std::map<std::string, bool> is_second;  // by what decides
  const bool are_two = divide(document, [&](const ordered_json& component) {
    const std::string decides = component[seed % 2 == 0 ? "executor" : "name"];
    const auto [place, is_new] = is_second.try_emplace(decides, false);
    if (is_new) place->second = draws() % 2 == 0;
    return place->second;
  });
  return are_two ? yaml_file(document) + std::string(kMachine) : "";
}

TEST(SimulatedProcesses, NothingTakesLongerThanItsBound) {
  std::size_t chains = 0, instances = 0;
  double closest = 0;
  for (std::uint64_t seed = 1; seed <= testing::random_systems(100); ++seed) {
    const std::string text = random_file_of_two(seed);
    if (text.empty()) continue;
    const SystemDescription system = of_processes(text);
    const auto bounds = bounds_between(system);
    if (bounds.empty()) continue;
    const Simulation simulation = simulation_of(system);
    ScenarioSearch search(seed);
    for (int run = 0; run < 8; ++run) {
      const SimulatedRun simulated = simulation.run(search.next());
      search.add(simulated, simulation.time_to_begin());
      for (const ProcessResult::ChainResult& chain : simulated.result.chains) {
        const auto bound = bounds.find(chain.name);
        if (bound == bounds.end()) continue;
        const Nanoseconds longest = chain.statistics.latency.max();
        ASSERT_LE(longest.count(), bound->second.count())
            << chain.name << ", seed " << seed << ", " << to_string(simulated.scenario) << ":\n"
            << text;
        ++chains;
        instances += chain.statistics.instances;
        closest = std::max(closest, static_cast<double>(longest.count()) /
                                        static_cast<double>(bound->second.count()));
      }
    }
  }
  std::printf("%zu chains between processes with %zu instances; largest latency ÷ bound: %.3f\n",
              chains, instances, closest);
  EXPECT_GT(instances, 0u);
  EXPECT_GT(closest, 0.9);
}

// An independent way to the same: where nothing takes time between processes, they are as one.
TEST(SimulatedProcesses, WithoutDelaysTheyAreAsOne) {
  // But for those that see a beginning; and where threads are made in another order.
  std::vector<std::string> types = executors_to_draw(), orders = schedulers().names();
  std::erase_if(orders, [](const auto& name) { return name == "chain_edf"; });
  std::erase_if(types, [](const auto& name) { return executors().traits(name).isolates; });
  std::size_t instances = 0;
  for (std::uint64_t seed = 1; seed <= testing::random_systems(60); ++seed) {
    ordered_json document = random_document(seed, types, orders);
    const std::string one = yaml_file(document) + std::string(kMachine);
    // The order of executors stays.
    const bool are_two = divide(
        document, [](const auto& component) { return component["executor"] != "executor_1"; });
    if (!are_two) continue;
    const std::string two = yaml_file(document) + std::string(kMachine);
    const Simulation of_one = simulation_of(of_processes(one)),
                     of_two = simulation_of(of_processes(two));
    for (std::uint64_t run = 1; run <= 2; ++run) {
      Scenario scenario{.seed = run, .phases = {}};  // which are drawn in the order of callbacks
      for (const SimulatedRun::Release& release : of_one.run(scenario).releases)
        scenario.phases[release.callback] = release.phase;
      const auto alone = of_one.run(scenario).result.chains;
      const auto divided = of_two.run(scenario).result.chains;
      for (std::size_t i = 0; i < alone.size(); ++i) {
        const ChainStatistics &a = alone[i].statistics, &b = divided[i].statistics;
        const std::string where = fmt::format("{}, seed {}:\n{}", alone[i].name, seed, two);
        ASSERT_EQ(a.instances, b.instances) << where;
        ASSERT_EQ(a.latency.min(), b.latency.min()) << where;
        ASSERT_EQ(a.latency.max(), b.latency.max()) << where;
        ASSERT_EQ(a.latency.mean(), b.latency.mean()) << where;
        instances += a.instances;
      }
    }
  }
  EXPECT_GT(instances, 10'000u);
}

/// Two processes on a CPU each: one sends every 10 ms, the other one answers to a third callback.
std::string there_and_back(std::string_view top = {},
                           std::string_view delay =
                               "/a: {delay: {min: 1ms, max: 2ms}}, /b: {delay: "
                               "500us}") {
  return fmt::format(R"({}
machine: {{cpus: 2, rt_runtime: unlimited, exclusive: true}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}, two: {{policy: SCHED_FIFO, priority: 50, affinity: [1]}}}}
executors: {{left: {{type: events, threads: [one]}}, right: {{type: events, threads: [two]}}}}
topics: {{{}}}
chains: [{{name: back, deadline: 8ms, path: [sender/a_timer, relay/a, last/b]}}]
containers:
  - name: left
    components:
      - {{component: takt::Workload, name: sender, executor: left, parameters: {{publishers: {{topic: [a], period_us: [10000], work_us: [1000]}}}}}}
      - {{component: takt::Workload, name: last, executor: left, parameters: {{subscriptions: {{topic: [b], work_us: [3000]}}}}}}
  - name: right
    components:
      - {{component: takt::Workload, name: relay, executor: right, parameters: {{relays: {{input: [a], output: [b], work_us: [2000]}}}}}}
)",
                     top, delay);
}

const ChainStatistics& chain_of(const SimulatedRun& run) {
  return run.result.chains.at(0).statistics;
}

TEST(SimulatedProcesses, MessagesTakeTheDelayOfTheirTopic) {
  const SystemDescription system = of_processes(there_and_back());
  const Simulation simulation = simulation_of(system);
  const SimulatedRun worst = simulation.run({});
  EXPECT_EQ(chain_of(worst).instances, 100u);
  EXPECT_EQ(chain_of(worst).latency.min(), 1ms + 2ms + 2ms + 500us + 3ms);
  EXPECT_EQ(chain_of(worst).latency.max(), 8500us);
  EXPECT_EQ(chain_of(worst).misses, 100u);
  EXPECT_GE(bounds_between(system).at("back"), 8500us);
  const SimulatedRun drawn = simulation.run({.times = Scenario::Times::drawn});
  EXPECT_GE(chain_of(drawn).latency.min(), 1ms + 1ms + 2ms + 0us + 3ms);
  EXPECT_LT(chain_of(drawn).latency.min(), 7200us);
  EXPECT_GT(chain_of(drawn).latency.max(), 8300us);
}

// When timers release no more, an input of a join was still on its way from another process: the
// instance was late by that, and its bound was "refuted".
TEST(SimulatedProcesses, TheEndOfARunMakesNoJoinLate) {
  const SystemDescription system = of_processes(R"(
machine: {cpus: [0, 1], rt_runtime: unlimited, exclusive: true}
threads: {a: {policy: SCHED_FIFO, priority: 70, affinity: [0]}, c: {policy: SCHED_FIFO, priority: 50, affinity: [1]}}
executors: {a: {type: events, threads: [a]}, c: {type: events, threads: [c]}}
topics: {/p0: {delay: 0us}, /p1: {delay: 12ms}}
containers:
  - name: P0
    components:
      - {component: takt::Workload, name: s0, executor: c, parameters: {publishers: {topic: [p0], period_us: [5000], work_us: [500]}}}
      - {component: takt::Workload, name: n0, executor: c, parameters: {relays: {input: [p0, p1], output: [r0, r0], work_us: [10, 10]}}}
      - {component: takt::Workload, name: k, executor: c, parameters: {subscriptions: {topic: [r0], work_us: [20]}}}
  - name: P1
    components:
      - {component: takt::Workload, name: s1, executor: a, parameters: {publishers: {topic: [p1], period_us: [40000], work_us: [1500]}}}
chains: [{name: c0, losses: allowed, path: [s0/p0_timer, n0/p0, k/r0]}]
)");
  const AnalyzedFile file = analyze_system(system, {.machine = MachineFacts{}});
  for (auto duration = 200ms; duration < 240ms; duration += 5ms) {
    const SimulatedRun run = simulation_of(system, duration).run({});
    const ChainStatistics chain = run.result.chains.at(0).statistics;
    EXPECT_GE(chain.instances, 4u);
    EXPECT_LE(chain.latency.max(), file.bounds.chains.at(0).bound.value()) << to_string(duration);
  }
}

TEST(SimulatedProcesses, RowsSayWhichProcess) {
  const SimulatedRun run = simulation_of(of_processes(there_and_back())).run({});
  std::map<std::string, std::string> callbacks, threads;
  for (const auto& row : run.result.callbacks)
    callbacks[row.statistics.node + "/" + row.statistics.callback] = row.process;
  for (const auto& row : run.result.threads) threads[row.statistics.in_force.name] = row.process;
  EXPECT_EQ(callbacks,
            (std::map<std::string, std::string>{
                {"/sender/a_timer", "left"}, {"/last/b", "left"}, {"/relay/a", "right"}}));
  EXPECT_EQ(threads, (std::map<std::string, std::string>{{"one", "left"}, {"two", "right"}}));
}

// Also where a thread of the file is there twice.
TEST(SimulatedProcesses, EachHasItsOwnThreads) {
  std::string text = there_and_back();
  text.replace(text.find("executor: right"), 15, "executor: left");
  text.replace(text.find(", right: {"),
               std::string_view(", right: {type: events, threads: [two]}").size(), "");
  const SimulatedRun run = simulation_of(of_processes(text)).run({});
  std::map<std::string, Nanoseconds> used;  // of 1 s
  for (const auto& row : run.result.threads) used[row.process] += row.statistics.cpu_time;
  EXPECT_EQ(used, (std::map<std::string, Nanoseconds>{{"left", 400ms}, {"right", 200ms}}));
}

TEST(SimulatedProcesses, ASeedSaysAll) {
  const SystemDescription system = of_processes(random_file_of_two(3));
  const Simulation simulation = simulation_of(system);
  const auto text_of = [&](std::uint64_t seed) {
    const Scenario scenario{.seed = seed, .times = Scenario::Times::drawn, .phases = {}};
    return rt::json_text(rt::run_json(rt::run_of(simulation.run(scenario).result), true));
  };
  const std::string first = text_of(1);
  EXPECT_NE(text_of(2), first);
  for (int i = 0; i < 5; ++i) ASSERT_EQ(text_of(1), first);
}

TEST(SimulatedProcesses, FaultsMeetWhatArrives) {
  const SystemDescription system = of_processes(there_and_back());
  const Simulation simulation = simulation_of(system);
  EXPECT_EQ(
      chain_of(simulation.run(parse_scenario("1,worst,all=0s,lost=/relay/a@100ms"))).instances,
      99u);
  const SimulatedRun late =
      simulation.run(parse_scenario("1,worst,all=0s,late=/relay/a@100ms+5ms"));
  EXPECT_EQ(chain_of(late).latency.max(), 8500us + 2ms);  // it would have come after 3 ms
}

// A thousand messages a second, of which each is under way, or waits for the reader, for 1.5 s:
// what belongs together is remembered of 1,024 messages.
TEST(SimulatedProcesses, WhatIsForgottenIsNoted) {
  const auto run = [](std::string_view delay, int blocks_us) {
    return simulation_of(of_processes(fmt::format(R"(
machine: {{cpus: 2, rt_runtime: unlimited, exclusive: true}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}, two: {{policy: SCHED_FIFO, priority: 50, affinity: [1]}}}}
executors: {{left: {{type: events, threads: [one]}}, right: {{type: events, threads: [two]}}}}
topics: {{/a: {{delay: {}}}}}
chains: [{{name: there, path: [sender/a_timer, reader/a]}}]
containers:
  - name: left
    components: [{{component: takt::Workload, name: sender, executor: left, parameters: {{publishers: {{topic: [a], period_us: [1000]}}}}}}]
  - name: right
    components:
      - {{component: takt::Workload, name: reader, executor: right, parameters: {{subscriptions: {{topic: [a], depth: [2000]}}}}}}
      - {{component: takt::Workload, name: block, executor: right, parameters: {{publishers: {{topic: [c], period_us: [10000000], work_us: [{}]}}}}}}
)",
                                                  delay, blocks_us)),
                         4s)
        .run({});
  };
  const auto forgotten = Contains(HasSubstr("are known no more: these are not counted"));
  const SimulatedRun under_way = run("1500ms", 1);
  EXPECT_EQ(chain_of(under_way).instances, 4000u);
  EXPECT_THAT(under_way.result.notes, ::testing::Not(forgotten));
  const SimulatedRun waits = run("0ms", 1'500'000);
  EXPECT_LT(chain_of(waits).instances, 3600u);
  EXPECT_THAT(waits.result.notes, forgotten);
}

// Only what a person can do something about is said.
TEST(SimulatedProcesses, WhatNothingTellsIsNoted) {
  const auto notes = [](std::string_view top, std::string_view delay) {
    return simulation_of(of_processes(there_and_back(top, delay))).run({}).result.notes;
  };
  EXPECT_THAT(
      notes("", "/a: {delay: 1ms}"),
      Contains("messages on '/b' between processes take no time: the topic has no `delay`"));
  EXPECT_THAT(notes("", "/a: {delay: 1ms}, /b: {delay: 1ms}"),
              ::testing::Not(Contains(HasSubstr("take no time"))));
  EXPECT_THAT([&] { notes("dds: {discovery: 'off'}", "/a: {delay: 1ms}"); },
              ::testing::ThrowsMessage<Error>(HasSubstr("do not find each other")));
}

TEST(SimulatedProcesses, AServiceBetweenThemIsRefused) {
  const SystemDescription system = of_processes(R"(
machine: {cpus: 1}
containers:
  - name: asks
    components: [{component: takt::Workload, name: client, parameters: {clients: {service: [s], period_us: [10000]}}}]
  - name: answers
    components: [{component: takt::Workload, name: server, parameters: {servers: {service: [s]}}}]
)");
  EXPECT_THAT([&] { simulation_of(system).run({}); },
              ::testing::ThrowsMessage<Error>(HasSubstr("a service between processes; give both "
                                                        "one container, or leave out the client")));
}

// As in a run: what a message brings from another process is when it was sent.
TEST(SimulatedProcesses, AnInstanceBeginsWhereAMessageArrives) {
  const auto simulated = [](std::string_view scheduler) {
    return simulation_of(of_processes(fmt::format(R"(
machine: {{cpus: 2, rt_runtime: unlimited, exclusive: true}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}, two: {{policy: SCHED_FIFO, priority: 50, affinity: [1]}}}}
executors: {{left: {{type: events, threads: [one]}}, right: {{type: events, scheduler: {}, threads: [two]}}}}
topics: {{/a: {{delay: 1ms}}}}
chains: [{{name: across, deadline: 50ms, path: [sender/a_timer, relay/a]}}, {{name: here, deadline: 50ms, path: [local/z_timer]}}]
containers:
  - name: left
    components:
      - {{component: takt::Workload, name: sender, executor: left, callbacks: {{a_timer: {{deadline: 1ms, overrun: abort}}}}, parameters: {{publishers: {{topic: [a], period_us: [100000], work_us: [5000]}}}}}}
  - name: right
    components:
      - {{component: takt::Workload, name: busy, executor: right, parameters: {{publishers: {{topic: [b], period_us: [100000], work_us: [10000]}}}}}}
      - {{component: takt::Workload, name: relay, executor: right, parameters: {{subscriptions: {{topic: [a], work_us: [2000]}}}}}}
      - {{component: takt::Workload, name: local, executor: right, parameters: {{publishers: {{topic: [z], period_us: [100000], work_us: [2000]}}}}}}
)",
                                                  scheduler)))
        .run(parse_scenario("1,worst,all=0s,/local/z_timer=3ms"));
  };
  for (const char* scheduler : {"chain_edf", "job_priority"}) {
    const auto chains = simulated(scheduler).result.chains;
    // At 10 ms both wait: one is from 3 ms, the other was sent at 5 ms, though it began at 0.
    EXPECT_EQ(chains[1].statistics.latency.max(), 9ms) << scheduler;
    EXPECT_EQ(chains[0].statistics.latency.max(), 14ms) << scheduler;
    EXPECT_EQ(chains[0].statistics.instances, 10u) << scheduler;  // none is aborted there
  }
}

struct Counted {
  std::uint32_t value = 0;
};
TAKT_MESSAGE(Counted, "test/msg/Counted", value);

std::map<std::string, std::uint64_t> counted;  // executions, by node and callback

/// Sends on one topic and reads another, and counts what runs.
class Counting : public Node, public KnowsExecutionTimes {
 public:
  explicit Counting(const NodeOptions& options) : Node("counting", options) {
    out_ = create_publisher<Counted>(declare_parameter<std::string>("output", "out"), 2,
                                     {.published_by = {"tick"}});
    timer_ = create_timer("tick", 3ms, [this] {
      ran("tick");
      out_->publish(Counted{});
    });
    const auto input = declare_parameter<std::string>("input", "in");
    in_ = create_subscription<Counted>(input, 2, [this, input](const Counted&) { ran(input); });
  }
  std::optional<Nanoseconds> execution_time(std::string_view callback) const override {
    return callback == "tick" ? 1ms : 2500us;
  }

 private:
  void ran(const std::string& callback) {
    ++counted[fully_qualified_name() + "/" + callback];
    if (ManualClock* const manual = clock().as_manual()) manual->work(*execution_time(callback));
  }
  Publisher<Counted>::SharedPtr out_;
  Timer::SharedPtr timer_;
  Subscription<Counted>::SharedPtr in_;
};

// No speed by skipping: what code counts is what is reported, also where there is too much to do.
TEST(SimulatedProcesses, EachExecutionIsOneOfTheCode) {
  const Simulation simulation = simulation_of(of_processes(R"(
machine: {cpus: 2}
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}, two: {policy: SCHED_FIFO, priority: 50, affinity: [1]}}
executors: {left: {type: events, threads: [one]}, right: {type: multi_threaded, threads: [two, one]}}
topics: {/there: {delay: 1ms}, /back: {delay: {min: 1ms, max: 4ms}}}
containers:
  - {name: left, components: [{component: takt::tools::Counting, name: a, executor: left, parameters: {output: there, input: back}}]}
  - {name: right, components: [{component: takt::tools::Counting, name: b, executor: right, parameters: {output: back, input: there}}]}
)"));
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    counted.clear();
    const SimulatedRun run =
        simulation.run({.seed = seed, .times = Scenario::Times::drawn, .phases = {}});
    std::map<std::string, std::uint64_t> reported;
    std::uint64_t missed = 0;
    for (const auto& row : run.result.callbacks)
      missed += row.statistics.dropped + row.statistics.skipped;
    EXPECT_GT(missed, 0u);
    for (const auto& row : run.result.callbacks)
      reported[row.statistics.node + "/" + row.statistics.callback] =
          row.statistics.execution.count();
    EXPECT_EQ(counted, reported);
    EXPECT_EQ(counted.size(), 4u);
    std::uint64_t all = 0;
    for (const auto& [name, count] : counted) all += count;
    EXPECT_EQ(run.executions, all);
  }
}

// Its timeline has a row for each process, and is the same each time.
TEST(SimulatedProcesses, HaveATimeline) {
  const SystemDescription system = of_processes(there_and_back());
  const TracedScenario first =
      traced(system, {.overrides = {}, .measured = {}, .duration = 100ms}, {}, "system.yaml");
  std::vector<std::string> processes;
  for (const TracedThread& thread : first.trace.threads) processes.push_back(thread.process);
  EXPECT_THAT(processes, ::testing::ElementsAre("left", "right"));
  EXPECT_EQ(first.trace.executions.size(), 30u);
}

}  // namespace
}  // namespace takt::tools

TAKT_REGISTER_COMPONENT(takt::tools::Counting, "counts its executions")
