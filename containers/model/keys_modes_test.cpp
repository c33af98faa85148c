// What modes do to bounds: each has a model of its own.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/model/bound_of_test.hpp"
#include "takt/containers/modes.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

/// Timers of 10 ms on one thread: `a`, whose messages `b` gets, and `log` after them. Each takes a
/// millisecond. The chain `c` is of a and b, and `l` of log.
Analyzed analyzed_in(std::size_t mode, const std::string& modes, const std::string& more = "") {
  const ConfigurationFile file("system.yaml", modes + R"(
realtime: require
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, scheduler: fixed_priority, threads: [one]}}
chains: [{name: c, deadline: 9ms, path: [a/x_timer, b/x]}, {name: l, deadline: 9ms, path: [log/log_timer]}]
container:
  name: moded
  components:
    - {component: takt::Workload, name: a, executor: default, callback_groups: {default: {priority: 3}}, parameters: {publishers: {topic: [x], period_us: [10000], work_us: [1000]}}}
    - {component: takt::Workload, name: b, executor: default, callback_groups: {default: {priority: 2}}, parameters: {subscriptions: {topic: [x], work_us: [1000]}}}
    - {component: takt::Workload, name: log, executor: default, callback_groups: {default: {priority: 1}}, parameters: {publishers: {topic: [log], period_us: [10000], work_us: [1000]}}}
)" + more);
  ignored_key = is_ignored;
  SystemDescription description = file.read();
  ignored_key = nullptr;
  for (const AssumptionKind& kind : assumption_kinds())
    description.accepted.try_emplace(std::string(kind.id), "a test");
  const Container container(description);
  const ModelledProcess process = Modes(description.modes).modelled(mode, container.modelled());
  SystemModel model =
      make_system_model(description, container.plan().chains, {&process, 1}, nullptr, kQuiet);
  ModelBounds bounds = analyze(model);
  return {std::move(model), std::move(bounds)};
}

std::optional<Nanoseconds> bound_in(std::size_t mode, const std::string& modes,
                                    std::size_t chain = 0) {
  const auto bound = analyzed_in(mode, modes).bounds.chains.at(chain).bound;
  if (!bound) return {};
  return std::chrono::ceil<std::chrono::microseconds>(*bound);  // as blocking is less than a job
}

TEST(Keys, WhatAModeDemotesComesAfterAllOthers) {
  const std::string modes = "modes: {calm: {demote: [a/x_timer, b/x]}}";
  EXPECT_EQ(bound_in(0, modes, 1), 3ms);  // log, after the others
  EXPECT_EQ(bound_in(1, modes, 1), 2ms);  // one of them may have begun
  EXPECT_EQ(bound_in(0, modes), 3ms);
  EXPECT_GE(bound_in(1, modes), 3ms);
  const Analyzed calm = analyzed_in(1, modes);
  EXPECT_LT(calm.model.system.callbacks.at(0).urgency, calm.model.system.callbacks.at(2).urgency);
}

TEST(Keys, WhatAModeDropsTakesNoTimeAndSendsNothing) {
  const std::string modes = "modes: {calm: {drop: [a/x_timer]}}";
  const Analyzed calm = analyzed_in(1, modes);
  EXPECT_EQ(verdict(calm.model.chains.at(0), calm.bounds.chains.at(0)), Verdict::dropped);
  EXPECT_EQ(calm.bounds.chains.at(0).bound, std::nullopt);
  EXPECT_EQ(calm.bounds.chains.at(0).why_not, "'/a/x_timer' is dropped in this mode");
  EXPECT_EQ(calm.bounds.chains.at(1).bound, 1ms);  // nothing comes to b either
  EXPECT_EQ(verdict(calm.model.chains.at(1), calm.bounds.chains.at(1)), Verdict::guaranteed);
  EXPECT_EQ(bound_in(0, modes, 1), 3ms);
}

TEST(Keys, AChainEndsWhereItsCallbackIsDropped) {
  const Analyzed calm = analyzed_in(1, "modes: {calm: {drop: [b/x]}}");
  EXPECT_EQ(calm.verdict(), Verdict::dropped);
  EXPECT_THAT(calm.bound().why_not, HasSubstr("'/b/x' is dropped"));
  EXPECT_EQ(calm.bounds.chains.at(1).bound, 2ms);
}

// A dispatch is what is left of it.
TEST(Keys, ADroppedCallbackIsDispatchedStill) {
  const std::string modes = "modes: {calm: {drop: [a/x_timer, b/x]}}\n";
  const Analyzed calm = analyzed_in(1, modes + "machine: {overheads: {dispatch: 10us}}");
  EXPECT_GT(calm.bounds.chains.at(1).bound, 1010us);
  EXPECT_LT(calm.bounds.chains.at(1).bound, 1050us);
}

TEST(Keys, AJoinThatWaitsForWhatIsDroppedEndsItsChain) {
  const std::string more =
      R"(    - {component: takt::Workload, name: j, executor: default, parameters: {relays: {input: [x, log], output: [z, z], work_us: [100, 100]}}}
    - {component: takt::Workload, name: e, executor: default, parameters: {subscriptions: {topic: [z], work_us: [100]}}}
chains: [{name: c, deadline: 90ms, path: [a/x_timer, j/x, e/z]}]
)";
  const auto joined = [&](std::size_t mode) {
    std::string modes = "modes: {calm: {drop: [log/log_timer]}}";
    const ConfigurationFile file("system.yaml", modes + R"(
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
container:
  name: moded
  components:
    - {component: takt::Workload, name: a, executor: default, parameters: {publishers: {topic: [x], period_us: [10000], work_us: [100]}}}
    - {component: takt::Workload, name: log, executor: default, parameters: {publishers: {topic: [log], period_us: [10000], work_us: [100]}}}
)" + more);
    const SystemDescription description = file.read();
    const Container container(description);
    const ModelledProcess process = Modes(description.modes).modelled(mode, container.modelled());
    const SystemModel model =
        make_system_model(description, container.plan().chains, {&process, 1}, nullptr, kQuiet);
    return std::pair(verdict(model.chains.at(0), analyze(model).chains.at(0)),
                     model.chains.at(0).why_not);
  };
  EXPECT_NE(joined(0).first, Verdict::dropped);
  EXPECT_EQ(joined(1).first, Verdict::dropped);
  EXPECT_THAT(joined(1).second, HasSubstr("'/log/log_timer' is dropped in this mode"));
}

TEST(Keys, ASwitchOfModesHasNoBound) {
  const std::string modes = "modes: {calm: {drop: [a/x_timer]}}";
  EXPECT_THAT(analyzed_in(0, modes).text_of("nothing_is_changed"),
              HasSubstr("no mode is switched"));
  EXPECT_THAT(analyzed_in(0, "").text_of("nothing_is_changed"),
              testing::Not(HasSubstr("no mode is switched")));
}

// Nobody can accept that it never comes.
TEST(Keys, ASwitchThatEachExecutionCausesIsCertain) {
  const auto found = [](std::size_t mode, const char* deadline) {
    return analyzed_in(
               mode, "modes: {calm: {drop: [log/log_timer], on: {overrun: slow/slow_timer}}}",
               fmt::format("    - {{component: takt::Workload, name: slow, executor: default, "
                           "parameters: {{publishers: {{topic: [slow], period_us: [50000], "
                           "work_us: [1000]}}}}, callbacks: {{slow_timer: {{deadline: {}}}}}}}\n",
                           deadline))
        .verdict();
  };
  EXPECT_EQ(found(0, "900us"), Verdict::refuted);
  EXPECT_EQ(found(0, "1100us"), Verdict::guaranteed);
  EXPECT_EQ(found(1, "900us"), Verdict::guaranteed);  // it is in force
}

// It is taken and destroyed, which takes the longer the larger it is.
TEST(Keys, WhatAModeDropsIsDestroyed) {
  const auto zero = [](const char* size) {
    const std::string more = fmt::format(
        "    - {{component: takt::Workload, name: big, executor: default, parameters: "
        "{{publishers: "
        "{{topic: [z], period_us: [10000], size_bytes: [{}]}}}}}}\n    - {{component: "
        "takt::Workload, "
        "name: d, executor: default, parameters: {{subscriptions: {{topic: [z]}}}}}}\n",
        size);
    return analyzed_in(1, "modes: {calm: {drop: [d/z]}}", more).text_of("overheads_are_zero");
  };
  EXPECT_THAT(zero("8000000"), HasSubstr("taking and destroying what a mode drops"));
  EXPECT_THAT(zero("100"), Not(HasSubstr("what a mode drops")));
}

TEST(Keys, OverheadsThatAreMeasuredHereAreOfThisMachine) {
  MachineFacts facts = kQuiet;
  facts.overhead_samples = 1000;
  const auto text = [&] {
    return analyzed(R"(
machine: {exclusive: true, overheads: {dispatch: 1us, wake: 1us, switch: 1us, publish: 1us}}
executors: {default: {type: events}}
chains: [{name: c, path: [a/x_timer]}]
container: {components: [{component: takt::Workload, name: a, executor: default, parameters: {publishers: {topic: [x], period_us: [10000], work_us: [1000]}}}]}
)",
                    nullptr, false, facts)
        .text_of("model_from_elsewhere");
  };
  EXPECT_THAT(text(), HasSubstr("though `machine: cpus` names another machine"));
  facts.name = "this one";
  EXPECT_EQ(text(), "");
}

// The advice of a service between processes was refused, and other keys set nothing.
TEST(Keys, AServiceHasADelayOfItsOwnName) {
  const auto longest = [](const std::string& topics) {
    const Analyzed found = analyzed("topics: {" + topics + R"(}
executors: {a: {type: events}}
machine: {exclusive: true}
containers:
  - {name: p1, components: [{component: takt::Workload, name: c, executor: a, parameters: {clients: {service: [sv], period_us: [10000]}}}]}
  - {name: p2, components: [{component: takt::Workload, name: s, executor: a, parameters: {servers: {service: [sv], work_us: [100]}}}]}
chains: [{name: c, path: [c/sv_timer]}]
)");
    analysis::Time delay = 0;
    for (const analysis::Callback& from : found.model.system.callbacks)
      for (const analysis::Output& output : from.outputs) delay = std::max(delay, output.delay);
    return delay;
  };
  EXPECT_EQ(longest("/sv: {delay: 1ms}"), Nanoseconds(1ms).count());
  EXPECT_EQ(longest(""), analysis::kUnbounded);
  EXPECT_THAT([&] { longest("/svRequest: {delay: 1ms}"); },
              ThrowsMessage<Error>(HasSubstr("topic or service '/svRequest'; valid: /sv")));
  EXPECT_THAT([&] { longest("/sv: {delay: 1ms, depth: 3}"); },
              ThrowsMessage<Error>(HasSubstr("'/sv' is a service, which has no 'depth'")));
}

}  // namespace
}  // namespace takt::test
