// A system under the executors of another file.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/replace_executors.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr std::string_view kContainer = R"(
container:
  name: robot
  components: [{component: takt::Workload, name: a, callbacks: {x: {priority: 7, deadline: 2ms}}}]
)";

SystemDescription file_of(std::string text, std::string_view container = kContainer) {
  provide_workload();
  return ConfigurationFile("robot.yaml", text + std::string(container)).read();
}

/// Two executors with three threads, and components on both and on a group's own.
SystemDescription robot() {
  return file_of(R"(
threads:
  fast: {policy: SCHED_FIFO, priority: 80}
  slow: {policy: SCHED_OTHER, nice: 5}
executors:
  one: {type: events, threads: [fast]}
  two: {type: multi_threaded, threads: [slow, slow]}
)",
                 R"(
container:
  name: robot
  components:
    - {component: takt::Workload, name: a, executor: one, callback_groups: {g: {executor: two, priority: 3}}}
    - {component: takt::Workload, name: b, executor: two, callbacks: {x: {priority: 7, deadline: 2ms}}}
)");
}

std::vector<std::string> threads_under(const std::string& other) {
  const SystemDescription system = replace_executors(robot(), file_of(other));
  EXPECT_EQ(system.executors.size(), 1u);
  for (const ComponentDescription& component : system.components) {
    EXPECT_EQ(component.executor, "all");
    for (const auto& [name, group] : component.callback_groups) EXPECT_EQ(group.executor, "");
  }
  return system.executors.front().threads;
}

TEST(ReplaceExecutors, TakesTheThreadsOfTheFileInTheirOrder) {
  EXPECT_THAT(threads_under("executors: {all: {type: events}}"), ElementsAre("fast"));
  EXPECT_THAT(threads_under("threads: {t: {}, u: {}}\n"
                            "executors: {all: {type: events, threads: [t, u]}}"),
              ElementsAre("fast", "slow", "slow"));
  EXPECT_THAT(threads_under("threads: {t: {}}\n"
                            "executors: {all: {type: events, threads: [t, t, t, t]}}"),
              ElementsAre("fast", "slow", "slow", "slow"));
  EXPECT_THAT(threads_under("executors: {all: {type: isolated}}"),
              ElementsAre("fast", "slow", "slow"));
}

TEST(ReplaceExecutors, TakesThoseOfTheOtherWhereTheFileHasNone) {
  const SystemDescription other = file_of(
      "threads: {t: {policy: SCHED_FIFO, priority: 30}}\n"
      "executors: {all: {type: events, threads: [t, t]}}");
  const SystemDescription system =
      replace_executors(file_of("executors: {default: {type: events}}"), other);
  EXPECT_THAT(system.executors.front().threads, ElementsAre("t", "t"));
  ASSERT_NE(find_thread(system, "t"), nullptr);
  EXPECT_EQ(find_thread(system, "t")->attributes.priority, 30);
}

TEST(ReplaceExecutors, MixesUpNoThreadsOfOneName) {
  const SystemDescription other = file_of(
      "threads: {t: {policy: SCHED_FIFO, priority: 30}}\n"
      "executors: {all: {type: events, threads: [t, t]}}");
  const SystemDescription system = replace_executors(
      file_of("threads: {t: {policy: SCHED_FIFO, priority: 77}}\ndds: {threads: t}\n"), other);
  EXPECT_THAT(system.executors.front().threads, ElementsAre("t-2", "t-2"));
  EXPECT_EQ(find_thread(system, "t-2")->attributes.priority, 30);
  EXPECT_EQ(find_thread(system, "t")->attributes.priority, 77);
}

TEST(ReplaceExecutors, KeepsABandThatTheFileHas) {
  const std::string band =
      "threads: {t: {policy: SCHED_FIFO, priority: 60..62, affinity: [0]}}\n"
      "executors: {default: {type: preemptive, threads: [t]}}";
  const SystemDescription system = replace_executors(
      file_of(band), file_of("threads: {u: {policy: SCHED_FIFO, priority: 10..12, affinity: [0]}}\n"
                             "executors: {all: {type: preemptive, threads: [u]}}"));
  EXPECT_THAT(system.executors.front().threads, ElementsAre("t-60", "t-61", "t-62"));
}

TEST(ReplaceExecutors, GivesABandFromTheMostUrgentThread) {
  const std::string other =
      "threads: {t: {policy: SCHED_FIFO, priority: 10..12, affinity: [0]}}\n"
      "executors: {all: {type: preemptive, threads: [t]}}";
  EXPECT_THAT(threads_under(other), ElementsAre("fast-80", "fast-81", "fast-82", "fast-83",
                                                "fast-84", "fast-85", "fast-86", "fast-87"));
  // Nothing is urgent there, so the other file says what is.
  const SystemDescription system = replace_executors(
      file_of("threads: {t: {}}\nexecutors: {default: {type: events, threads: [t]}}"),
      file_of(other));
  EXPECT_THAT(system.executors.front().threads, ElementsAre("t-10", "t-11", "t-12"));
  for (const std::string& name : system.executors.front().threads)
    EXPECT_NE(find_thread(system, name), nullptr) << name;
}

// The band of the other file was analysed on a CPU that the machine does not have.
TEST(ReplaceExecutors, PutsThreadsOnTheMachinesCpus) {
  const SystemDescription other = file_of(
      "threads: {t: {policy: SCHED_FIFO, priority: 10..11, affinity: [0]}}\n"
      "executors: {all: {type: preemptive, threads: [t]}}");
  const auto cpus_under = [&](const std::string& text) {
    std::vector<int> cpus;
    const SystemDescription system = replace_executors(file_of(text), other);
    for (const std::string& name : system.executors.front().threads) {
      const std::vector<int>& its = find_thread(system, name)->attributes.affinity;
      cpus.insert(cpus.end(), its.begin(), its.end());
    }
    return cpus;
  };
  EXPECT_THAT(cpus_under("machine: {cpus: [0, 7]}"), ElementsAre(0, 0));
  EXPECT_THAT(cpus_under("machine: {cpus: [7, 8]}"), ElementsAre(7, 7));
  EXPECT_THAT(cpus_under("machine: {cpus: [7, 8]}\n"
                         "threads: {u: {policy: SCHED_FIFO, priority: 98}}\n"
                         "executors: {default: {type: events, threads: [u]}}"),
              ElementsAre(7, 7));
}

TEST(ReplaceExecutors, SaysWhereNothingInterrupts) {
  const auto notes_under = [](int priority) {
    return replace_executors(
               file_of(fmt::format("threads: {{u: {{policy: SCHED_FIFO, priority: {}}}}}\n"
                                   "executors: {{default: {{type: events, threads: [u]}}}}",
                                   priority)),
               file_of("threads: {t: {policy: SCHED_FIFO, priority: 10..11, affinity: [0]}}\n"
                       "executors: {all: {type: preemptive, threads: [t]}}"))
        .notes;
  };
  EXPECT_THAT(notes_under(98), IsEmpty());
  EXPECT_THAT(notes_under(99), ElementsAre("executor 'all' runs on 'u-99', where nothing "
                                           "interrupts: no priority above it is free"));
}

TEST(ReplaceExecutors, KeepsPrioritiesUnlessTheOtherSaysHowTheyCome) {
  const SystemDescription kept =
      replace_executors(robot(), file_of("executors: {all: {type: events}}"));
  EXPECT_EQ(kept.components[1].callbacks.at("x").parameters.priority, 7);
  EXPECT_FALSE(kept.priorities);
  const SystemDescription replaced = replace_executors(
      robot(), file_of("priorities: rate_monotonic\nexecutors: {all: {type: events}}"));
  EXPECT_EQ(replaced.priorities, PriorityMethod::rate_monotonic);
  EXPECT_FALSE(replaced.components[0].callback_groups.at("g").parameters.priority);
  const CallbackParameters& x = replaced.components[1].callbacks.at("x").parameters;
  EXPECT_FALSE(x.priority);
  EXPECT_EQ(x.deadline, std::chrono::milliseconds(2));
}

TEST(ReplaceExecutors, LeavesTheChainsToTaktWhereTheOtherHasNoExecutor) {
  const SystemDescription system = replace_executors(robot(), file_of("chains: auto"));
  EXPECT_TRUE(system.finds_chains);
  EXPECT_THAT(system.executors, IsEmpty());
  for (const ComponentDescription& component : system.components) EXPECT_EQ(component.executor, "");
}

TEST(ReplaceExecutors, RefusesExecutorsThatFitOnlyTheirOwnFile) {
  const auto errors = [](const std::string& other, std::string_view container = kContainer) {
    const SystemDescription system = file_of(other, container);
    EXPECT_THAT([&] { replace_executors(robot(), system); },
                ThrowsMessage<Error>(HasSubstr("copy its `executors`, and name your own")))
        << other;
    return why_it_fits_no_other(system);
  };
  EXPECT_EQ(errors(""), "it has no executor, and no chains");
  EXPECT_EQ(errors("executors: {one: {}, two: {}}"),
            "it says which components go to which executor");
  EXPECT_EQ(errors("executors: {all: {type: triggered, order: [a/x]}}"),
            "its `order` names callbacks");
  EXPECT_EQ(errors("executors: {all: {type: triggered, trigger: {one: a/x}}}"),
            "its `trigger` names a callback");
  EXPECT_EQ(errors("threads: {t: {policy: SCHED_DEADLINE, runtime: 1ms, period: 5ms}}\n"
                   "executors: {all: {type: events, threads: [t]}}"),
            "its thread has a reservation for its own callbacks");
}

}  // namespace
}  // namespace takt
