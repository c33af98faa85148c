// Each key of a file, each field of what the model is made of, and each way in which a system may
// change has an entry in the table: what has none fails here, or does not compile.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/coverage.hpp"

#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/containers/configuration/reference.hpp"
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
  const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n] = all;
  return count(a, b, c, d, e, f, g, h, i, j, k, l, m, n);
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

}  // namespace
}  // namespace takt::test
