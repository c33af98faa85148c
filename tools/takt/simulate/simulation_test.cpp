// Simulations of random systems, beside the bounds of their analysis.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/simulation.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/run.hpp"
#include "takt/testing/random_system.hpp"

#include "analyze/analyzed_file.hpp"
#include "random/random_system.hpp"
#include "yaml_file.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;

/// On two CPUs of a machine that is not this one.
std::string random_file(std::uint64_t seed) {
  const RandomOptions options{.seed = seed,
                              .executors = executors_to_draw(),
                              .schedulers = schedulers().names(),
                              .cpus = {0, 1}};
  return yaml_file(random_system(options).document) +
         "machine: {cpus: 2, rt_runtime: 950ms, exclusive: true, overheads: {dispatch: 5us, wake: "
         "20us, "
         "switch: 3us}}\n";
}

Scenario scenario_of(std::uint64_t seed, int run) {
  Scenario scenario{.seed = seed};
  if (run != 0) scenario.phases.clear();
  if (run == 2) scenario.times = Scenario::Times::drawn;
  return scenario;
}

/// A mode of a random system, which drops and demotes some of what it may; empty: nothing.
std::string random_mode(const AnalyzedFile& file, std::uint64_t seed) {
  std::mt19937_64 draws(seed);
  std::string dropped, demoted;
  const auto add = [](std::string& list, const std::string& name) {
    list += (list.empty() ? "'" : ", '") + name.substr(1) + "'";
  };
  for (const ModelledProcess::Callback& callback : file.processes.front().callbacks) {
    const auto& all = file.model.system.callbacks;
    const std::string name = to_string(Chain::Step{callback.node, callback.entity->name()});
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const auto& modelled) { return modelled.name == name; });
    const EntityKind kind = callback.entity->kind();
    const bool may_drop = kind == EntityKind::timer || kind == EntityKind::subscription;
    const bool may_demote =
        file.model.system.executors.at(found->executor).order == analysis::Order::by_urgency;
    const std::uint64_t die = draws() % 6;
    if (die == 0 && may_drop) add(dropped, name);
    if (die == 1 && may_demote) add(demoted, name);
  }
  if (dropped.empty() && demoted.empty()) return "";
  return fmt::format("modes: {{calm: {{drop: [{}], demote: [{}]}}}}\n", dropped, demoted);
}

TEST(Simulation, NothingTakesLongerThanItsBoundInAMode) {
  std::size_t chains = 0, without_instances = 0;
  for (std::uint64_t seed = 1; seed <= testing::random_systems(60); ++seed) {
    std::string text = random_file(seed);
    {
      const auto system = ConfigurationFile("system.yaml", text).read();
      text = random_mode(analyze_system(system, {.machine = MachineFacts{}}), seed) + text;
    }
    const SystemDescription system = ConfigurationFile("system.yaml", text).read();
    if (system.modes.empty()) continue;
    std::map<std::string, std::optional<Nanoseconds>> bounds;
    {
      const AnalyzedFile file = analyze_system(system, {.machine = MachineFacts{}});
      const AnalyzedFile::Mode& mode = file.modes.at(0);
      for (std::size_t i = 0; i < mode.model.chains.size(); ++i) {
        const SystemModel::Chain& chain = mode.model.chains[i];
        if (chain.is_dropped) bounds[chain.name] = std::nullopt;
        if (const auto bound = mode.bounds.chains[i].bound) bounds[chain.name] = *bound;
      }
    }
    const Simulation simulation(system,
                                {.overrides = {.mode = "calm"}, .measured = {}, .duration = 2s});
    for (int run = 0; run < 3; ++run) {
      const SimulatedRun simulated = simulation.run(scenario_of(seed, run));
      for (const ProcessResult::ChainResult& chain : simulated.result.chains) {
        const auto bound = bounds.find(chain.name);
        if (bound == bounds.end()) continue;
        const std::string where =
            fmt::format("{}, seed {}, run {}:\n{}", chain.name, seed, run, text);
        if (!bound->second) {
          ASSERT_EQ(chain.statistics.instances, 0u) << where;
          ++without_instances;
          continue;
        }
        ASSERT_LE(chain.statistics.latency.max().count(), bound->second->count()) << where;
        ++chains;
      }
    }
  }
  std::printf("%zu chains in a mode, and %zu that it drops\n", chains, without_instances);
  EXPECT_GT(chains, 0u);
  EXPECT_GT(without_instances, 0u);
}

// The same bytes, whatever else runs in the process before.
TEST(Simulation, ASeedSaysAll) {
  const SystemDescription system = ConfigurationFile("system.yaml", random_file(6)).read();
  const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 5s});
  const auto text_of = [&](std::uint64_t seed) {
    return rt::json_text(
        rt::run_json(rt::run_of(simulation.run(scenario_of(seed, 2)).result), true));
  };
  const std::string first = text_of(1);
  EXPECT_NE(text_of(2), first);
  for (int i = 0; i < 5; ++i) ASSERT_EQ(text_of(1), first);
}

// ---- Components whose code does not run ----

struct Word {
  std::uint32_t value = 0;
};
TAKT_MESSAGE(Word, "test/msg/Word", value);

int bodies_run = 0;

/// Its timer sends on `a`, of whose messages it sends each on to `b`.
class Mute : public Node {
 public:
  explicit Mute(const NodeOptions& options) : Node("mute", options) {
    const auto counts = [] { ++bodies_run; };
    a_ = create_publisher<Word>("a", 10, {.published_by = {"tick"}});
    b_ = create_publisher<Word>("b", 10, {.published_by = {"a"}});
    parts_ = {create_timer("tick", 10ms, counts),
              create_subscription<Word>("a", 10, [counts](const Word&) { counts(); }),
              create_subscription<Word>("b", 10, [counts](const Word&) { counts(); }),
              create_subscription<Word>("c", 10, [counts](const Word&) { counts(); })};
  }

 private:
  Publisher<Word>::SharedPtr a_, b_;
  std::vector<std::shared_ptr<void>> parts_;
};

std::string mute_file(const std::string& top = {}, const std::string& thread = "affinity: [3]",
                      const std::string& executor = "type: events",
                      const std::string& callbacks =
                          "a: {execution: 2ms}, b: {execution: 3ms}, c: "
                          "{execution: 4ms}") {
  return top + fmt::format(R"(
threads: {{one: {{policy: SCHED_FIFO, priority: 50, {}}}}}
executors: {{default: {{threads: [one], {}}}}}
chains: [{{name: c, deadline: 50ms, path: [mute/tick, mute/a, mute/b]}}]
container:
  name: simulated
  components:
    - component: takt::tools::Mute
      name: mute
      executor: default
      callbacks: {{tick: {{execution: 1ms}}, {}}}
)",
                           thread, executor, callbacks);
}

ProcessResult simulated(const std::string& text, Nanoseconds duration = 1s) {
  const Simulation simulation(ConfigurationFile("system.yaml", text).read(),
                              {.overrides = {}, .measured = {}, .duration = duration});
  return simulation.run({}).result;
}

const CallbackStatistics& of(const ProcessResult& result, std::string_view callback) {
  return std::find_if(result.callbacks.begin(), result.callbacks.end(),
                      [&](const auto& row) { return row.statistics.callback == callback; })
      ->statistics;
}

TEST(Simulation, CallbacksTakeTheirTimeAndSend) {
  bodies_run = 0;
  const ProcessResult result = simulated(mute_file("machine: {cpus: 4}\n"));
  EXPECT_EQ(bodies_run, 0);
  EXPECT_EQ(result.chains.front().statistics.instances, 100u);
  EXPECT_EQ(result.chains.front().statistics.latency.max(), 6ms);
  EXPECT_EQ(of(result, "b").latency.max(), 0ms);
  EXPECT_EQ(of(result, "c").received, 0u);
  EXPECT_EQ(of(result, "c").lost(), 0u);
  EXPECT_EQ(result.threads.front().statistics.in_force.affinity, std::vector<int>{3});
  EXPECT_NEAR(result.threads.front().statistics.cpu_percent(), 60, 0.001);
}

// It waited for ever where one took longer than an hour.
TEST(Simulation, EndsWhenItsTimeIsOver) {
  const ProcessResult result =
      simulated(mute_file("machine: {cpus: 4}\n", "affinity: [3]", "type: events",
                          "a: {execution: 3h}, b: {execution: 3ms}, c: {execution: 4ms}"));
  EXPECT_EQ(result.chains.front().statistics.instances, 0u);
}

TEST(Simulation, RunsInTheModeThatIsGiven) {
  const std::string text = mute_file("modes: {calm: {drop: [mute/b]}}\nmachine: {cpus: 4}\n");
  const auto in_mode = [&](const char* mode) {
    const Simulation simulation(ConfigurationFile("system.yaml", text).read(),
                                {.overrides = {.mode = mode}, .measured = {}, .duration = 1s});
    return simulation.run({}).result;
  };
  EXPECT_EQ(of(in_mode("normal"), "b").received, 100u);
  const ProcessResult calm = in_mode("calm");
  EXPECT_EQ(of(calm, "b").received, 0u);
  EXPECT_EQ(of(calm, "b").dropped_by_mode, 100u);
  EXPECT_EQ(of(calm, "b").lost(), 0u);
  EXPECT_EQ(calm.chains.front().statistics.instances, 0u);
}

TEST(Simulation, TheMachineIsThatOfTheFile) {
  const auto longest = [](const std::string& machine) {
    return simulated(mute_file("machine: {cpus: 4, " + machine + "}\n"))
        .chains.front()
        .statistics.latency.max();
  };
  EXPECT_NEAR(static_cast<double>(longest("speed: {3: 0.75}").count()), 8e6,
              3);  // each is rounded up
  EXPECT_EQ(longest("overheads: {dispatch: 100us}"), 6300us);
  EXPECT_EQ(longest("overheads: {wake: 40us, switch: 5us}"), 6045us);
  // It needs 600 ms of each second: from 0.83 s on it waits for the next one.
  EXPECT_GT(longest("rt_runtime: 500ms"), 150ms);
}

TEST(Simulation, MessagesComeFromOutside) {
  const std::string callbacks =
      "a: {execution: 2ms}, b: {execution: 1ms}, c: {execution: 1ms, arrival: {distances: [0ms, "
      "100ms]}}";
  const ProcessResult result =
      simulated(mute_file("machine: {cpus: 4}\n", "affinity: [3]", "type: events", callbacks));
  EXPECT_EQ(of(result, "c").received, 20u);       // two each 100 ms
  EXPECT_EQ(of(result, "c").latency.max(), 2ms);  // behind 'tick' and one of its own
}

// Any number at any time came at once, so the simulation went on for ever.
TEST(Simulation, WhatNobodyTellsOfDoesNotCome) {
  const ProcessResult result = simulated(R"(
machine: {cpus: 1}
container:
  components:
    - {component: takt::Workload, name: s, parameters: {publishers: {topic: [p], period_us: [50000]}}}
    - {component: takt::Workload, name: n, parameters: {relays: {input: [p, r], output: [r, r], work_us: [100, 100]}}}
)");
  EXPECT_EQ(of(result, "p").received, 20u);
  EXPECT_THAT(result.notes, ::testing::Contains(::testing::HasSubstr(
                                "what comes to '/n/r' besides: nothing tells how often")));
}

TEST(Simulation, PeriodsHoldBackWhatIsSent) {
  const ProcessResult result =
      simulated(mute_file("machine: {cpus: 4}\n", "affinity: [3]", "type: triggered, let: 20ms"));
  EXPECT_GE(result.chains.front().statistics.latency.max(), 60ms);
}

TEST(Simulation, CallbacksInterruptEachOther) {
  const auto longest = [](const char* executor, const char* priority) {
    return simulated(fmt::format(R"(
machine: {{cpus: 8}}
threads: {{urgent: {{policy: SCHED_FIFO, priority: {}, affinity: [7]}}}}
executors: {{fast: {{{}, scheduler: fixed_priority, threads: [urgent]}}}}
chains: [{{name: c, path: [quick/z_timer]}}]
container:
  name: simulated
  components:
    - {{component: takt::Workload, name: slow, executor: fast, parameters: {{publishers: {{topic: [x], period_us: [50000], work_us: [10000]}}}}}}
    - {{component: takt::Workload, name: quick, executor: fast, callbacks: {{z_timer: {{priority: 9}}}}, parameters: {{publishers: {{topic: [z], period_us: [3000], work_us: [200]}}}}}}
)",
                                 priority, executor))
        .chains.front()
        .statistics.latency.max();
  };
  EXPECT_EQ(longest("type: preemptive", "60..61"), 200us);
  EXPECT_GT(longest("type: events", "60"), 7ms);
}

// ---- Long work in batches ----

/// Plans for 6 ms, in batches, and controls each 4 ms, for 1 ms.
class InBatches : public Node {
 public:
  explicit InBatches(const NodeOptions& options) : Node("planner", options) {
    each_ = std::chrono::milliseconds(declare_parameter<int>("batch_ms", 2));
    const auto planning = create_callback_group("planning", CallbackGroupType::MutuallyExclusive);
    plan_ = create_timer(
        "plan", 40ms, [this] { return plan(); }, planning);
    control_ = create_timer("control", 4ms, [this] { work(1ms); });
  }

 private:
  void work(Nanoseconds duration) {
    if (ManualClock* const manual = clock().as_manual()) manual->work(duration);
  }
  Task<> plan() {
    for (Nanoseconds done{0}; done < 6ms; done += each_) {
      if (done != 0ns) co_await batch();
      work(each_);
    }
  }

 protected:
  Nanoseconds each_{0};

 private:
  Timer::SharedPtr plan_, control_;
};

/// The same, whose code runs in a simulation.
class InKnownBatches : public InBatches, public KnowsExecutionTimes {
 public:
  using InBatches::InBatches;
  std::optional<Nanoseconds> execution_time(std::string_view callback) const override {
    if (callback == "plan/resumed/alarm") return 0ns;  // it does not sleep
    return callback == "control" ? 1ms : each_;
  }
};

std::string batches_file(const std::string& component, int batch_ms) {
  return fmt::format(R"(
machine: {{cpus: 1}}
threads: {{one: {{policy: SCHED_FIFO, priority: 50, affinity: [0]}}}}
executors: {{default: {{type: events, scheduler: fixed_priority, threads: [one]}}}}
chains: [{{name: c, deadline: 50ms, path: [planner/control]}}]
container:
  components:
    - component: takt::tools::{}
      name: planner
      executor: default
      parameters: {{batch_ms: {}}}
      callback_groups: {{planning: {{priority: -1}}}}
)",
                     component, batch_ms);
}

TEST(Simulation, ABatchIsAllThatDelaysOthers) {
  const auto result_of = [](int batch_ms) {
    return simulated(batches_file("InKnownBatches", batch_ms));
  };
  const ProcessResult short_ones = result_of(2), one = result_of(6);
  EXPECT_EQ(short_ones.chains.front().statistics.latency.max(), 2ms);
  EXPECT_EQ(of(short_ones, "plan/resumed").execution.max(), 2ms);
  EXPECT_EQ(of(short_ones, "plan/resumed").execution.count(), 50u);
  EXPECT_EQ(one.chains.front().statistics.latency.max(), 4ms);
}

// ---- Groups with threads ----

/// Three timers of 4 ms in a reentrant group, and one of 1 ms in a group of its own.
class Grouped : public Node {
 public:
  explicit Grouped(const NodeOptions& options) : Node("grouped", options) {
    const auto several = create_callback_group("several", CallbackGroupType::Reentrant);
    const auto control = create_callback_group("control", CallbackGroupType::MutuallyExclusive);
    for (const char* name : {"a", "b", "c"}) {
      timers_.push_back(create_timer(
          name, 20ms, [] {}, several));
    }
    timers_.push_back(create_timer(
        "control", 20ms, [] {}, control));
  }

 private:
  std::vector<Timer::SharedPtr> timers_;
};

/// From release to start, in ms, of a, b, c and control.
std::vector<std::int64_t> waits(const std::string& executors, const std::string& groups = {}) {
  const ProcessResult result = simulated(fmt::format(R"(
machine: {{cpus: 3}}
threads:
  any: {{policy: SCHED_FIFO, priority: 50}}
  own: {{policy: SCHED_FIFO, priority: 80}}
executors: {{{}}}
container:
  components:
    - component: takt::tools::Grouped
      name: grouped
      executor: pool
      callback_groups: {{{}}}
      callbacks: {{a: {{execution: 4ms}}, b: {{execution: 4ms}}, c: {{execution: 4ms}}, control: {{execution: 1ms}}}}
)",
                                                     executors, groups));
  std::vector<std::int64_t> found;
  for (const char* name : {"a", "b", "c", "control"}) {
    found.push_back(of(result, name).latency.max() / 1ms);
  }
  return found;
}

TEST(Simulation, ReentrantGroupsOfIsolatedHaveThreads) {
  using ::testing::ElementsAre;
  const std::string isolated = "pool: {type: isolated, per: group, threads: [any]";
  EXPECT_THAT(waits(isolated + "}"), ElementsAre(0, 4, 8, 0));
  EXPECT_THAT(waits(isolated + ", reentrant_threads: 2}"), ElementsAre(0, 0, 4, 0));
  EXPECT_THAT(waits(isolated + ", reentrant_threads: 3}", "control: {priority: 80}"),
              ElementsAre(0, 0, 0, 0));
}

// A pool, and a thread of its own for a group that the file names (rclcpp's draft 3247).
TEST(Simulation, AGroupHasAThreadBesideAPool) {
  using ::testing::ElementsAre;
  const std::string pool = "pool: {type: events, threads: [any, any]}";
  EXPECT_THAT(waits(pool), ElementsAre(0, 0, 4, 4));
  EXPECT_THAT(waits(pool + ", own: {type: events, threads: [own]}", "control: {executor: own}"),
              ElementsAre(0, 0, 4, 0));
}

// Of two workers one is busy from 5.1 ms on, and the other one is at work until 7.2 ms. It slept at
// once, and `spin` was refused.
TEST(Simulation, APoolWaitsAsOnRealCpus) {
  const auto latencies = [](std::string_view spins, std::string_view second) {
    const SystemDescription system = ConfigurationFile("system.yaml", fmt::format(R"(
machine: {{cpus: 3, exclusive: true, rt_runtime: unlimited, overheads: {{wake: 100us}}}}
threads:
  a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}
  b: {{policy: SCHED_FIFO, priority: 60, affinity: [1]}}
  c: {{policy: SCHED_FIFO, priority: 60, affinity: [2]}}
  low: {{policy: SCHED_FIFO, priority: 40, affinity: [1]}}
executors: {{pool: {{type: events, threads: [a, b]{}}}, source: {{type: events, threads: [c]}}, low: {{type: events, threads: [low]}}}}
chains: [{{name: long, path: [long/l_timer]}}, {{name: second, path: [source/w_timer, reader/w]}}, {{name: low, path: [low/z_timer]}}]
container:
  name: robot
  components:
    - {{component: takt::Workload, name: long, executor: pool, parameters: {{publishers: {{topic: [l], period_us: [50000], work_us: [5000]}}}}}}
    - {{component: takt::Workload, name: source, executor: source, parameters: {{publishers: {{topic: [x, w], period_us: [50000, 50000], work_us: [1, 1]}}}}}}
    - {{component: takt::Workload, name: reader, executor: pool, parameters: {{subscriptions: {{topic: [x, w], work_us: [1000, 100]}}}}}}
    - {{component: takt::Workload, name: low, executor: low, parameters: {{publishers: {{topic: [z], period_us: [50000], work_us: [5]}}}}}}
)",
                                                                                  spins))
                                         .read();
    const Simulation simulation(system, {.overrides = {}, .measured = {}, .duration = 30ms});
    const SimulatedRun run = simulation.run(parse_scenario(fmt::format(
        "1,worst,/long/l_timer=5ms,/source/x_timer=6ms,/source/w_timer={},/low/z_timer=7105us",
        second)));
    std::vector<Nanoseconds> result;
    for (const auto& chain : run.result.chains) result.push_back(chain.statistics.latency.max());
    return result;
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(latencies("", "7110us"), ElementsAre(5100us, 201us, 231us));
  EXPECT_THAT(latencies("", "7130us"), ElementsAre(5100us, 301us, 121us));
  EXPECT_THAT(latencies(", spin: 100us", "7130us"), ElementsAre(5100us, 201us, 331us));
  EXPECT_THAT(latencies(", early_wake: 150us", "7130us"), ElementsAre(5000us, 301us, 121us));
}

TEST(Simulation, WhatCannotBeSimulatedIsRefusedByName) {
  const auto error = [](const std::string& text) -> std::string {
    try {
      simulated(text);
    } catch (const Error& refused) {
      return refused.what();
    }
    return "";
  };
  using ::testing::HasSubstr;
  const std::string machine = "machine: {cpus: 4}\n";
  EXPECT_EQ(error(mute_file(machine)), "");
  EXPECT_THAT(error(mute_file(machine, "affinity: [3]", "type: events", "a: {execution: 1ms}")),
              HasSubstr("cannot simulate '/mute/b': its execution time is not known"));
  EXPECT_THAT(
      error(mute_file("modes: {calm: {drop: [mute/a]}}\n" + machine)),
      HasSubstr("system.yaml:1: cannot simulate the modes of the file without `--mode`: a "
                "simulation does not switch; choose the one to simulate: --mode normal, calm"));
  std::string text = mute_file(machine);
  text.replace(text.find("      executor: default"), 23,
               "      executor: default\n      parameters: {use_sim_time: true}");
  EXPECT_THAT(error(text), HasSubstr("which follows /clock (`use_sim_time`)"));
  EXPECT_THAT(error(batches_file("InBatches", 2)),
              HasSubstr("'/planner/plan/resumed' cannot be simulated: it is a coroutine"));
}

}  // namespace
}  // namespace takt::tools

TAKT_REGISTER_COMPONENT(takt::tools::Mute, "does nothing")
TAKT_REGISTER_COMPONENT(takt::tools::Grouped, "has groups of both kinds")
TAKT_REGISTER_COMPONENT(takt::tools::InBatches, "plans in batches")
TAKT_REGISTER_COMPONENT(takt::tools::InKnownBatches, "plans in batches of known length")
