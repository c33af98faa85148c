// Tests of every scheduler that is registered, and of the exact order of each of ours.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/sched/scheduler_check.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::ThrowsMessage;

// The infos and records of a set of callbacks; record i has info i.
class Callbacks {
 public:
  explicit Callbacks(std::vector<CallbackInfo> infos) : infos_(std::move(infos)) {
    records_.resize(infos_.size());
    for (std::size_t i = 0; i < infos_.size(); ++i) {
      infos_[i].id = static_cast<CallbackId>(i);
      records_[i].info = &infos_[i];
      records_[i].sequence = i + 1;
    }
  }
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;

  std::unique_ptr<Scheduler> make(std::string_view scheduler) const {
    auto result = schedulers().make(scheduler, {});
    result->configure(infos_);
    return result;
  }
  ReadyCallback& operator[](std::size_t i) { return records_[i]; }
  std::size_t size() const { return records_.size(); }

 private:
  std::vector<CallbackInfo> infos_;
  std::vector<ReadyCallback> records_;
};

std::vector<CallbackId> pop_all(Scheduler& scheduler) {
  std::vector<CallbackId> ids;
  while (const ReadyCallback* callback = scheduler.pop()) {
    ids.push_back(callback->info->id);
    scheduler.done(*callback, Nanoseconds(1));
  }
  return ids;
}

// Pushes in this order and pops all.
std::vector<CallbackId> order(std::string_view scheduler, Callbacks& callbacks,
                              const std::vector<std::size_t>& pushes) {
  const auto instance = callbacks.make(scheduler);
  for (const std::size_t i : pushes) instance->push(callbacks[i]);
  return pop_all(*instance);
}

std::vector<CallbackInfo> random_infos(std::mt19937& random, std::size_t count) {
  std::vector<CallbackInfo> infos(count);
  for (std::size_t i = 0; i < count; ++i) {
    infos[i].kind = static_cast<EntityKind>(random() % 5);
    infos[i].registration = static_cast<std::uint32_t>(i);
    infos[i].group = static_cast<GroupId>(random() % 4);
    infos[i].priority = static_cast<int>(random() % 3);
    infos[i].period = Nanoseconds(random() % 1000);
    infos[i].deadline = Nanoseconds(random() % 1000);
    infos[i].budget = Nanoseconds(random() % 1000);
    infos[i].chain = static_cast<ChainId>(random() % 3);
    // A chain has one criticality; its positions count from 0.
    infos[i].criticality = static_cast<int>(infos[i].chain);
    infos[i].chain_position = static_cast<std::uint32_t>(i);
  }
  return infos;
}

// ---- Every scheduler ----

class EveryScheduler : public testing::TestWithParam<std::string> {
 protected:
  std::mt19937 random_{17};
};

INSTANTIATE_TEST_SUITE_P(Scheduler, EveryScheduler, testing::ValuesIn(schedulers().names()),
                         [](const auto& test) { return test.param; });

TEST_P(EveryScheduler, HasADescription) {
  EXPECT_FALSE(schedulers().description(GetParam()).empty());
}

TEST_P(EveryScheduler, KeepsItsSideOfTheInterface) {
  EXPECT_NO_THROW(
      check_scheduler(GetParam(), [name = GetParam()] { return schedulers().make(name, {}); }));
}

TEST_P(EveryScheduler, RunsEqualCallbacksInOrderOfArrivalHoweverTheyArePushed) {
  constexpr std::size_t kCount = 20;
  std::vector<CallbackInfo> infos(kCount);
  // rclcpp's order knows no arrival inside a polling point, only registration.
  for (std::size_t i = 0; i < kCount; ++i) infos[i].registration = static_cast<std::uint32_t>(i);
  Callbacks callbacks(std::move(infos));
  std::vector<std::size_t> pushes(kCount);
  std::vector<CallbackId> expected(kCount);
  for (std::size_t i = 0; i < kCount; ++i) expected[i] = static_cast<CallbackId>(pushes[i] = i);
  for (int round = 0; round < 20; ++round) {
    std::shuffle(pushes.begin(), pushes.end(), random_);
    ASSERT_EQ(order(GetParam(), callbacks, pushes), expected);
  }
}

TEST_P(EveryScheduler, GivesTheSameOrderForTheSamePushes) {
  Callbacks callbacks(random_infos(random_, 50));
  std::vector<std::size_t> pushes(callbacks.size());
  for (std::size_t i = 0; i < pushes.size(); ++i) pushes[i] = i;
  std::shuffle(pushes.begin(), pushes.end(), random_);
  EXPECT_EQ(order(GetParam(), callbacks, pushes), order(GetParam(), callbacks, pushes));
}

TEST_P(EveryScheduler, LooksAtTimeOnlyIfItSaysSo) {
  if (schedulers().traits(GetParam()).uses_time) GTEST_SKIP() << "it says so";
  Callbacks callbacks(random_infos(random_, 50));
  std::vector<std::size_t> pushes(callbacks.size());
  for (std::size_t i = 0; i < pushes.size(); ++i) pushes[i] = i;
  const std::vector<CallbackId> without_times = order(GetParam(), callbacks, pushes);
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    callbacks[i].ready_time = TimePoint(Nanoseconds(random_() % 1000));
    callbacks[i].deadline = TimePoint(Nanoseconds(random_() % 1000));
  }
  EXPECT_EQ(order(GetParam(), callbacks, pushes), without_times);
}

TEST_P(EveryScheduler, GoesByPriorityIfItSaysSo) {
  if (schedulers().traits(GetParam()).order != analysis::Order::by_urgency)
    GTEST_SKIP() << "it does not";
  std::vector<CallbackInfo> infos = random_infos(random_, 50);
  for (CallbackInfo& info : infos) info.chain = kNoChain, info.criticality = 0;
  Callbacks callbacks(infos);
  std::vector<std::size_t> pushes(callbacks.size());
  for (std::size_t i = 0; i < pushes.size(); ++i) pushes[i] = i;
  std::vector<int> priorities;
  for (const CallbackId id : order(GetParam(), callbacks, pushes)) {
    priorities.push_back(infos[id].priority);
  }
  EXPECT_TRUE(std::is_sorted(priorities.rbegin(), priorities.rend()));
}

// ---- The order of each ----

TEST(Schedulers, AreRegisteredUnderTheirNames) {
  EXPECT_THAT(schedulers().names(), IsSupersetOf({"chain_priority", "edf", "fifo", "fixed_priority",
                                                  "ros", "round_robin"}));
  EXPECT_TRUE(schedulers().traits("edf").uses_time);
  EXPECT_FALSE(schedulers().traits("fifo").uses_time);
  EXPECT_EQ(schedulers().traits("fixed_priority").order, analysis::Order::by_urgency);
  EXPECT_THAT([] { schedulers().make("fixed_prio", {}); },
              ThrowsMessage<Error>(HasSubstr("no scheduler is called 'fixed_prio'")));
}

TEST(Schedulers, ShowWhatTheyWouldPop) {
  std::mt19937 random(3);
  for (const std::string& name : schedulers().names()) {
    Callbacks callbacks(random_infos(random, 20));
    const auto instance = callbacks.make(name);
    EXPECT_EQ(instance->peek(), nullptr) << name;
    std::vector<ReadyCallback*> away;
    for (std::size_t i = 0; i < callbacks.size(); ++i) away.push_back(&callbacks[i]);
    for (std::uint64_t step = 1; step < 500; ++step) {
      if (!away.empty() && random() % 2 == 0) {
        std::swap(away[random() % away.size()], away.back());
        if (random() % 4 != 0) away.back()->sequence = callbacks.size() + step / 3;  // some equal
        instance->push(*away.back());
        away.pop_back();
      }
      ReadyCallback* const first = instance->peek();
      if (random() % 2 != 0) continue;
      ASSERT_EQ(instance->pop(), first) << name;
      if (first != nullptr) away.push_back(first);
    }
  }
}

TEST(Schedulers, NameEntityKindsInRclcppsOrderOfService) {
  EXPECT_LT(EntityKind::timer, EntityKind::subscription);
  EXPECT_LT(EntityKind::subscription, EntityKind::service);
  EXPECT_LT(EntityKind::service, EntityKind::client);
  EXPECT_LT(EntityKind::client, EntityKind::waitable);
  EXPECT_EQ(to_string(EntityKind::timer), "timer");
  EXPECT_EQ(to_string(EntityKind::waitable), "waitable");
}

TEST(FifoScheduler, RunsInOrderOfArrivalAndLooksAtNothingElse) {
  Callbacks callbacks({{.kind = EntityKind::waitable, .registration = 3, .priority = 1},
                       {.kind = EntityKind::timer, .registration = 2, .priority = 9},
                       {.kind = EntityKind::subscription, .registration = 1, .criticality = 9}});
  callbacks[0].sequence = 5;
  callbacks[1].sequence = 7;
  callbacks[2].sequence = 6;
  EXPECT_THAT(order("fifo", callbacks, {1, 2, 0}), ElementsAre(0, 2, 1));
}

TEST(FifoScheduler, PutsACallbackThatComesBackWithAYoungerMessageBehindTheOthers) {
  Callbacks callbacks(std::vector<CallbackInfo>(3));
  const auto scheduler = callbacks.make("fifo");
  for (std::size_t i = 0; i < 3; ++i) scheduler->push(callbacks[i]);
  ReadyCallback* first = scheduler->pop();
  ASSERT_EQ(first, &callbacks[0]);
  first->sequence = 10;
  scheduler->push(*first);
  EXPECT_THAT(pop_all(*scheduler), ElementsAre(1, 2, 0));
}

TEST(FifoScheduler, RunsTheEarliestWhateverIsPushedLate) {
  constexpr std::size_t kCount = 20;
  Callbacks callbacks{std::vector<CallbackInfo>(kCount)};
  const auto scheduler = callbacks.make("fifo");
  std::mt19937 random(17);
  std::set<std::pair<std::uint64_t, std::size_t>> waiting;  // what the scheduler must have
  std::vector<std::size_t> idle(kCount);
  std::iota(idle.begin(), idle.end(), 0);
  for (std::uint64_t now = 100; now < 20'000; ++now) {
    if (!idle.empty() && random() % 2 == 0) {
      const std::size_t i = idle.back();
      idle.pop_back();
      callbacks[i].sequence = random() % 4 == 0 ? now * 10 - random() % 100 : now * 10 + 1;
      scheduler->push(callbacks[i]);
      waiting.emplace(callbacks[i].sequence, i);
    } else if (waiting.empty()) {
      ASSERT_EQ(scheduler->pop(), nullptr);
    } else {
      const ReadyCallback* const first = scheduler->pop();
      ASSERT_NE(first, nullptr);
      ASSERT_EQ(first->sequence, waiting.begin()->first);
      waiting.erase({first->sequence, first->info->id});
      idle.push_back(first->info->id);
    }
  }
}

TEST(RosScheduler, RunsByPollingPointThenKindThenRegistration) {
  Callbacks callbacks({{.kind = EntityKind::waitable, .registration = 0},
                       {.kind = EntityKind::client, .registration = 1},
                       {.kind = EntityKind::subscription, .registration = 3},
                       {.kind = EntityKind::subscription, .registration = 2},
                       {.kind = EntityKind::service, .registration = 4},
                       {.kind = EntityKind::timer, .registration = 6},
                       {.kind = EntityKind::timer, .registration = 5},
                       {.kind = EntityKind::timer, .registration = 7}});
  for (std::size_t i = 0; i < callbacks.size(); ++i) callbacks[i].window = 1;
  callbacks[0].window = 0;  // remains from the polling point before, so it comes first
  callbacks[7].window = 2;
  EXPECT_THAT(order("ros", callbacks, {7, 1, 0, 5, 2, 6, 4, 3}),
              ElementsAre(0, 6, 5, 3, 2, 4, 1, 7));
}

TEST(FixedPriorityScheduler, RunsTheLargestPriorityFirstThenByArrival) {
  Callbacks callbacks({{.priority = 0},
                       {.priority = 50},
                       {.priority = -5},
                       {.priority = 50},
                       {.priority = 99},
                       {.priority = 0}});
  EXPECT_THAT(order("fixed_priority", callbacks, {5, 4, 3, 2, 1, 0}),
              ElementsAre(4, 1, 3, 0, 5, 2));
}

TEST(FixedPriorityScheduler, LetsAnUrgentCallbackOvertakeThoseThatWait) {
  Callbacks callbacks({{.priority = 1}, {.priority = 1}, {.priority = 2}});
  const auto scheduler = callbacks.make("fixed_priority");
  scheduler->push(callbacks[0]);
  scheduler->push(callbacks[1]);
  EXPECT_EQ(scheduler->pop(), &callbacks[0]);
  scheduler->push(callbacks[2]);
  EXPECT_THAT(pop_all(*scheduler), ElementsAre(2, 1));
}

TEST(ChainPriorityScheduler, RunsCriticalChainsFirstAndTheirLaterCallbacksBeforeTheEarlier) {
  Callbacks callbacks({{.priority = 99},  // in no chain
                       {.criticality = 1, .chain = 1, .chain_position = 0},
                       {.criticality = 1, .chain = 1, .chain_position = 2},
                       {.criticality = 2, .chain = 2, .chain_position = 0},
                       {.criticality = 2, .chain = 2, .chain_position = 1},
                       {.priority = 100}});
  EXPECT_THAT(order("chain_priority", callbacks, {0, 1, 2, 3, 4, 5}),
              ElementsAre(4, 3, 2, 1, 5, 0));
}

TEST(ChainPriorityScheduler, OrdersChainsOfEqualCriticalityByPriorityThenByArrival) {
  Callbacks callbacks({{.priority = 1, .criticality = 1, .chain = 1},
                       {.priority = 2, .criticality = 1, .chain = 2},
                       {.priority = 1, .criticality = 1, .chain = 3}});
  EXPECT_THAT(order("chain_priority", callbacks, {2, 1, 0}), ElementsAre(1, 0, 2));
}

TEST(EdfScheduler, RunsTheEarliestDeadlineFirstAndThoseWithoutLast) {
  Callbacks callbacks({{.priority = 99}, {}, {}, {}, {.priority = 99}});
  callbacks[1].deadline = TimePoint(Nanoseconds(70));
  callbacks[2].deadline = TimePoint(Nanoseconds(50));
  callbacks[3].deadline = TimePoint(Nanoseconds(70));
  EXPECT_THAT(order("edf", callbacks, {4, 3, 2, 1, 0}), ElementsAre(2, 1, 3, 0, 4));
}

TEST(ChainEdfScheduler, CountsTheDeadlineOfAChainFromWhenItsInstanceBegan) {
  Callbacks callbacks({{.deadline = 1ns},  // its own counts for nothing
                       {.chain = 1, .chain_deadline = 50ns},
                       {.chain = 2, .chain_deadline = 20ns},
                       {.chain = 2, .chain_deadline = 20ns},
                       {.chain = 3}});
  callbacks[0].deadline = TimePoint(1ns);
  callbacks[1].root_ready_time = TimePoint(10ns);  // by 60
  callbacks[2].root_ready_time = TimePoint(50ns);  // by 70
  callbacks[3].root_ready_time = TimePoint(30ns);  // by 50
  callbacks[4].root_ready_time = TimePoint(1ns);
  EXPECT_THAT(order("chain_edf", callbacks, {4, 0, 1, 2, 3}), ElementsAre(3, 1, 2, 0, 4));
}

TEST(JobPriorityScheduler, RunsCriticalChainsFirstAndOfOneChainTheEarlierInstance) {
  Callbacks callbacks({{.priority = 99},  // in no chain
                       {.criticality = 1, .chain = 1, .chain_position = 2},
                       {.criticality = 1, .chain = 2, .chain_position = 0},
                       {.priority = 7, .criticality = 2, .chain = 3},
                       {.priority = 100}});
  callbacks[1].root_ready_time = TimePoint(40ns);
  callbacks[2].root_ready_time = TimePoint(30ns);
  callbacks[3].root_ready_time = TimePoint(90ns);
  EXPECT_THAT(order("job_priority", callbacks, {0, 1, 2, 3, 4}), ElementsAre(3, 2, 1, 4, 0));
}

TEST(LeastLaxityScheduler, RunsWhoMustStartFirst) {
  Callbacks callbacks({{.budget = Nanoseconds(10)}, {.budget = Nanoseconds(60)}, {}, {}});
  callbacks[0].deadline = TimePoint(Nanoseconds(70));  // must start at 60
  callbacks[1].deadline = TimePoint(Nanoseconds(90));  // at 30
  callbacks[2].deadline = TimePoint(Nanoseconds(60));  // at 60, and arrived later
  EXPECT_THAT(order("least_laxity", callbacks, {3, 2, 1, 0}), ElementsAre(1, 0, 2, 3));
}

TEST(RoundRobinScheduler, TakesOneCallbackOfEachGroupInTurn) {
  Callbacks callbacks(
      {{.group = 0}, {.group = 0}, {.group = 0}, {.group = 2}, {.group = 1}, {.group = 1}});
  EXPECT_THAT(order("round_robin", callbacks, {0, 1, 2, 3, 4, 5}), ElementsAre(0, 3, 4, 1, 5, 2));
}

TEST(RoundRobinScheduler, LetsNoBusyGroupHoldUpAnother) {
  Callbacks callbacks({{.group = 0}, {.group = 0}, {.group = 1}});
  const auto scheduler = callbacks.make("round_robin");
  std::uint64_t sequence = 100;
  scheduler->push(callbacks[0]);
  scheduler->push(callbacks[1]);
  EXPECT_EQ(scheduler->pop(), &callbacks[0]);
  scheduler->push(callbacks[2]);
  callbacks[0].sequence = ++sequence;
  scheduler->push(callbacks[0]);  // the busy group has work again
  EXPECT_THAT(pop_all(*scheduler), ElementsAre(1, 2, 0));
}

}  // namespace
}  // namespace takt
