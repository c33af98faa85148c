// Each key of a file, each field of what the model is made of, and each way in which a system may
// change has an entry in the table: what has none fails here, or does not compile.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/coverage.hpp"

#include <chrono>
#include <map>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/reference.hpp"
#include "takt/containers/model/bound_of_test.hpp"
#include "takt/containers/model/measured_model.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/executors/executor.hpp"

namespace takt::test {
namespace {

using ::testing::IsSubsetOf;
using ::testing::UnorderedElementsAreArray;

std::set<std::string> facts_of(std::string_view of) {
  std::set<std::string> result;
  for (const CoverageEntry& entry : coverage_table()) {
    if (entry.of == of) result.emplace(entry.fact);
  }
  return result;
}

TEST(Coverage, HasOneEntryForEachFact) {
  std::map<std::pair<std::string_view, std::string_view>, int> entries;
  for (const CoverageEntry& entry : coverage_table()) {
    const int count = ++entries[std::make_pair(entry.of, entry.fact)];
    EXPECT_EQ(count, 1) << entry.of << ": " << entry.fact;
    EXPECT_FALSE(entry.why.empty()) << entry.of << ": " << entry.fact;
  }
}

// The maps of the reader of files, and no others of the same name.
TEST(Coverage, HasEachKeyOfTheFile) {
  std::map<std::string, std::set<std::string>> keys;
  for (const auto& sections : {describe_configuration(), describe_workload()}) {
    for (const ReferenceSection& section : sections) {
      for (const ReferenceKey& key : section.keys) keys[section.title].insert(key.key);
    }
  }
  EXPECT_GT(keys.size(), 25u);
  for (const auto& [title, of_section] : keys) {
    EXPECT_EQ(facts_of(title), of_section)
        << "of " << title << ", in containers/model/coverage.cpp";
  }
}

template <class... Fields>
std::size_t count(const Fields&... /*unused*/) {
  return sizeof...(Fields);
}

// Another field does not compile: then the table needs an entry, and the model a reader, for it.
std::size_t fields_of(const QoS& all) {
  const auto& [a, b, c, d, e, f, g] = all;
  return count(a, b, c, d, e, f, g);
}
struct CoveredWord {
  int letters = 0;
};
TAKT_MESSAGE(CoveredWord, "test/msg/CoveredWord", letters);
std::size_t fields_of(const PublisherOptions<CoveredWord>& all) {
  const auto& [a, b, c, d, e, f] = all;
  return count(a, b, c, d, e, f);
}
std::size_t fields_of(const TriggerOptions& all) {
  const auto& [a, b, c, d, e] = all;
  return count(a, b, c, d, e);
}
std::size_t fields_of(const ThreadAttributes& all) {
  const auto& [a, b, c, d, e, f, g, h] = all;
  return count(a, b, c, d, e, f, g, h);
}
std::size_t fields_of(const CallbackParameters& all) {
  const auto& [a, b, c, d, e, f, g, h, i, j] = all;
  return count(a, b, c, d, e, f, g, h, i, j);
}
std::size_t fields_of(const ExecutorTraits& all) {
  const auto& [a, b, c, d, e, f, g, h, i, j, k, l] = all;
  return count(a, b, c, d, e, f, g, h, i, j, k, l);
}
std::size_t fields_of(const SchedulerTraits& all) {
  const auto& [a, b, c, d, e] = all;
  return count(a, b, c, d, e);
}
std::size_t fields_of(const MeasuredModel& all) {
  const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q] = all;
  return count(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q);
}
std::size_t fields_of(const MeasuredCallback& all) {
  const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o] = all;
  return count(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o);
}
std::size_t fields_of(const MeasuredChain& all) {
  const auto& [a, b, c, d, e, f] = all;
  return count(a, b, c, d, e, f);
}
// What a file says of a callback, an executor, a machine: its keys are compared above.
std::size_t fields_of(const MachineDescription& all) {
  const auto& [a, b, c, d, e, f, g, h, i, j] = all;
  return count(a, b, c, d, e, f, g, h, i, j);
}

TEST(Coverage, HasEachFieldOfWhatTheModelIsMadeOf) {
  EXPECT_EQ(facts_of("QoS").size(), fields_of(QoS()));
  EXPECT_EQ(facts_of("publisher options").size(), fields_of(PublisherOptions<CoveredWord>()));
  EXPECT_EQ(facts_of("trigger options").size(), fields_of(TriggerOptions()));
  EXPECT_EQ(facts_of("thread attributes").size(), fields_of(ThreadAttributes()));
  EXPECT_EQ(facts_of("callback parameters").size(), fields_of(CallbackParameters()));
  EXPECT_EQ(facts_of("an executor type").size(), fields_of(ExecutorTraits()));
  EXPECT_EQ(facts_of("a scheduler type").size(), fields_of(SchedulerTraits()));
  EXPECT_EQ(facts_of("a measured model").size(), fields_of(MeasuredModel()));
  EXPECT_EQ(facts_of("a measured callback").size(), fields_of(MeasuredCallback()));
  EXPECT_EQ(facts_of("a measured chain").size(), fields_of(MeasuredChain()));
  // cpus, speed, six of overheads, rt_runtime, exclusive
  EXPECT_EQ(facts_of("a machine").size() + 5, fields_of(MachineDescription()));
}

TEST(Coverage, HasEachKindOfEntity) {
  std::set<std::string> kinds;
  for (int kind = 0; kind <= static_cast<int>(EntityKind::waitable); ++kind) {
    kinds.emplace(to_string(static_cast<EntityKind>(kind)));
  }
  EXPECT_EQ(facts_of("a kind of entity"), kinds);
}

// ---- What cannot matter ----

/// Verdicts, bounds and assumptions, without names.
std::string summary(const Analyzed& found) {
  std::string result;
  for (std::size_t i = 0; i < found.model.chains.size(); ++i) {
    const auto& [chain, bound] = std::tie(found.model.chains[i], found.bounds.chains[i]);
    result += fmt::format("{} {} {} {};", to_string(verdict(chain, bound)),
                          bound.bound.value_or(Nanoseconds(0)).count(), bound.one_of,
                          bound.why_not.empty());
    for (const Assumption& each : chain.assumptions)
      result += fmt::format(" {} {}", each.id, to_string(each.state));
  }
  return result;
}

/// A key of the file, and two of its values, in one place of it.
struct Irrelevant {
  const char *of, *fact;
  const char *place, *before, *after;
};
constexpr Irrelevant kIrrelevantKeys[] = {
    {"the file", "cpu_dma_latency_us", "HEAD", "cpu_dma_latency_us: 0", "cpu_dma_latency_us: 90"},
    {"a thread", "nice", "NICE", ", nice: 1", ", nice: 9"},
    {"dds", "domain", "DDS", "domain: 1", "domain: 2"},
    {"dds", "diagnostics", "DDS", "diagnostics: 'on'", "diagnostics: 'off'"},
    {"dds", "parameter_services", "DDS", "parameter_services: true", "parameter_services: false"},
    {"dds", "ros_graph", "DDS", "ros_graph: jazzy", "ros_graph: 'off'"},
    {"dds", "rosout", "DDS", "rosout: true", "rosout: false"},
    {"dds", "synchronized_clocks", "DDS", "synchronized_clocks: true",
     "synchronized_clocks: false"},
    {"a topic", "must_match", "TOPIC", ", must_match: true", ", must_match: false"},
    {"an executor", "wait", "EXECUTOR", ", wait: futex", ", wait: epoll"},
    {"a container", "name", "PROCESS", "p", "other"},
    {"a container", "load", "CONTAINER", ", load: 'off'", ", load: any"},
    {"a restart", "delay", "CONTAINER", ", restart: {policy: always, delay: 1s}",
     ", restart: {policy: always, delay: 9s}"},
    {"a restart", "most", "CONTAINER", ", restart: {policy: always, most: 1}",
     ", restart: {policy: always, most: 9}"},
    {"a component", "name", "NODE", "x", "other"},
    {"a component", "namespace", "SPACE", "/a", "/other"},
    {"a component", "log_level", "COMPONENT", ", log_level: debug", ", log_level: error"},
    {"the lifecycle", "heartbeat", "LIFECYCLE", ", heartbeat: 1s", ", heartbeat: 9s"},
    {"a chain", "name", "CHAIN", "c", "other"},
    {"a reserved thread", "signals", "THREAD", ", signals: {policy: SCHED_FIFO, priority: 1}",
     ", signals: {policy: SCHED_FIFO, priority: 99}"},
};

// The same, of what a run has shown.
struct IrrelevantFigure {
  const char *of, *fact;
  void (*change)(MeasuredModel&);
};
constexpr IrrelevantFigure kIrrelevantFigures[] = {
    {"a measured model", "lines",
     [](MeasuredModel& model) {
       model.lines = {{"c", "m:1"}};
     }},
    {"a measured callback", "median_execution",
     [](MeasuredModel& model) { model.callbacks[0].median_execution += Nanoseconds(9); }},
    {"a measured callback", "p99_execution",
     [](MeasuredModel& model) { model.callbacks[0].p99_execution += Nanoseconds(9); }},
    {"a measured callback", "longest_first_execution",
     [](MeasuredModel& model) { model.callbacks[0].longest_first_execution += Nanoseconds(9); }},
    {"a measured chain", "median",
     [](MeasuredModel& model) { model.chains[0].median += Nanoseconds(9); }},
    {"a measured chain", "p99",
     [](MeasuredModel& model) { model.chains[0].p99 += Nanoseconds(9); }},
    {"a measured chain", "p999",
     [](MeasuredModel& model) { model.chains[0].p999 += Nanoseconds(9); }},
};

std::string replaced(std::string text, std::string_view place, std::string_view with) {
  for (std::size_t at = text.find(place); at != text.npos; at = text.find(place, at + with.size()))
    text.replace(at, place.size(), with);
  return text;
}

std::string with_each(const Irrelevant& key, const char* value) {
  std::string text = R"(
HEAD
threads: {a: {policy: SCHED_FIFO, priority: 60, affinity: [0]}, o: {affinity: [1]NICE}THREAD}
machine: {cpus: [0, 1], exclusive: true}
executors: {e: {type: events, threads: [a]EXECUTOR}, f: {type: events, threads: [o]}}
dds: {DDS}
topics: {/t: {delay: 1msTOPIC}}
lifecycle: {bring_up: [l]LIFECYCLE}
chains: [{name: CHAIN, deadline: 90ms, path: [NODE/t_timer, z/t]}, {name: d, deadline: 90ms, path: [SPACE/w/w_timer]}]
containers:
  - {name: PROCESS, components: [{component: takt::Workload, name: NODE, executor: eCOMPONENT, parameters: {publishers: {topic: [/t], period_us: [20000], work_us: [100]}}}]CONTAINER}
  - name: q
    components:
      - {component: takt::Workload, name: z, executor: f, parameters: {subscriptions: {topic: [/t], work_us: [100]}}}
      - {component: takt::Workload, name: w, namespace: SPACE, executor: f, parameters: {publishers: {topic: [w], period_us: [20000], work_us: [100]}}}
      - {component: takt::LifecycleWorkload, name: l, executor: f, parameters: {subscriptions: {topic: [/t]}}}
)";
  text = replaced(text, key.place, value);
  for (const auto& [place, usual] : {std::pair{"HEAD", ""},
                                     {"NICE", ""},
                                     {"THREAD", ""},
                                     {"EXECUTOR", ""},
                                     {"DDS", ""},
                                     {"TOPIC", ""},
                                     {"LIFECYCLE", ""},
                                     {"CHAIN", "c"},
                                     {"PROCESS", "p"},
                                     {"NODE", "x"},
                                     {"SPACE", "/a"},
                                     {"COMPONENT", ""},
                                     {"CONTAINER", ""}})
    text = replaced(text, place, usual);
  return text;
}

// The number of a chain's instances was for people, and refuted the model.
TEST(Coverage, WhatCannotMatterDoesNot) {
  std::set<std::string> tried;
  for (const Irrelevant& key : kIrrelevantKeys) {
    tried.insert(fmt::format("{}: {}", key.of, key.fact));
    EXPECT_EQ(summary(analyzed(with_each(key, key.before))),
              summary(analyzed(with_each(key, key.after))))
        << key.of << ": " << key.fact;
  }
  const std::string text = with_each(kIrrelevantKeys[0], "");
  MeasuredModel run{.duration = std::chrono::seconds(9)};
  run.callbacks.push_back({.name = "/x/t_timer", .executions = 90});
  MeasuredCallback& callback = run.callbacks[0];
  callback.least_execution = callback.median_execution = callback.p99_execution =
      callback.longest_first_execution = std::chrono::microseconds(10);
  callback.longest_execution = std::chrono::microseconds(100);
  callback.least_distances = {std::chrono::milliseconds(20)};
  run.chains.push_back({.name = "c", .instances = 80, .longest = std::chrono::milliseconds(1)});
  for (const IrrelevantFigure& figure : kIrrelevantFigures) {
    tried.insert(fmt::format("{}: {}", figure.of, figure.fact));
    MeasuredModel changed = run;
    figure.change(changed);
    EXPECT_EQ(summary(analyzed(text, &run)), summary(analyzed(text, &changed)))
        << figure.of << ": " << figure.fact;
  }
  // What the code has, and the keys of iRobot's workloads, which become parameters or nothing.
  const std::set<std::string_view> others = {
      "publisher options", "trigger options", "thread attributes", "an executor type",
      "a scheduler type",  "a publisher",     "a subscriber",      "a client",
      "a server",          "a load policy"};
  for (const CoverageEntry& entry : coverage_table()) {
    if (entry.coverage != Coverage::irrelevant || others.contains(entry.of)) continue;
    EXPECT_TRUE(tried.contains(fmt::format("{}: {}", entry.of, entry.fact)))
        << entry.of << ": " << entry.fact << " has no two values here";
  }
}

}  // namespace
}  // namespace takt::test
