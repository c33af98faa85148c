// Tests of callbacks for what happens to publishers and subscriptions besides messages.
// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/qos_event.hpp"

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/nodes/node.hpp"

namespace takt::qos_event_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::ThrowsMessage;

struct Scan {
  int id = 0;
};
TAKT_MESSAGE(Scan, "test_msgs/msg/Scan", id);

class QosEvents : public testing::Test {
 protected:
  std::shared_ptr<Publisher<Scan>> publisher(const QoS& qos = 10) {
    return there_->create_publisher<Scan>("scan", qos, {.loans = 20});
  }
  std::shared_ptr<Subscription<Scan>> subscription(const QoS& qos = 10) {
    return here_->create_subscription<Scan>("scan", qos, [](const Scan&) {});
  }
  template <class Status, class End>
  std::shared_ptr<Entity> event(const End& end, std::vector<Status>& reported) {
    return here_->create_qos_event<Status>(end, [&](const Status& s) { reported.push_back(s); });
  }
  // As an executor would.
  static void run(Entity& entity) {
    for (Slot slot; entity.take(slot); slot = {}) entity.execute(slot);
  }

  ManualClock clock_{TimePoint(1h)};
  const std::shared_ptr<Node> here_ = std::make_shared<Node>("here", NodeOptions{.clock = &clock_});
  const std::shared_ptr<Node> there_ =
      std::make_shared<Node>("there", NodeOptions{.clock = &clock_});
};

TEST_F(QosEvents, ReportMatchesAtBothEnds) {
  const auto scan = subscription();
  std::vector<MatchedStatus> at_subscription, at_publisher;
  const auto first = event(*scan, at_subscription);
  run(*first);
  EXPECT_TRUE(at_subscription.empty());  // nothing has happened
  auto from = publisher();
  const auto second = event(*from, at_publisher);
  run(*first);
  run(*second);
  ASSERT_EQ(at_subscription.size(), 1u);
  EXPECT_EQ(at_subscription[0].current_count, 1);
  EXPECT_EQ(at_subscription[0].total_count, 1u);
  ASSERT_EQ(at_publisher.size(), 1u);  // what was so when the event was made
  EXPECT_EQ(at_publisher[0].current_count_change, 1);
  from.reset();
  from = publisher();
  from.reset();
  run(*first);
  ASSERT_EQ(at_subscription.size(), 2u);  // once for all
  EXPECT_EQ(at_subscription[1].current_count, 0);
  EXPECT_EQ(at_subscription[1].current_count_change, -1);
  EXPECT_EQ(at_subscription[1].total_count_change, 1u);
  EXPECT_EQ(first->name(), "/scan/subscription/matched");
  EXPECT_EQ(second->name(), "/scan/publisher/matched");
}

TEST_F(QosEvents, ReportTheIncompatiblePolicy) {
  const auto scan = subscription(QoS(10).transient_local());
  const auto from = publisher();
  std::vector<IncompatibleQosStatus> at_subscription, at_publisher;
  const auto first = event(*scan, at_subscription);
  const auto second = event(*from, at_publisher);
  run(*first);
  run(*second);
  ASSERT_EQ(at_subscription.size(), 1u);
  EXPECT_EQ(at_subscription[0].last_policy, "durability");
  ASSERT_EQ(at_publisher.size(), 1u);
  EXPECT_EQ(at_publisher[0].total_count, 1u);
}

TEST_F(QosEvents, ReportLostMessages) {
  const auto scan = subscription(1);
  const auto from = publisher();
  std::vector<MessageLostStatus> reported;
  const auto lost = event(*scan, reported);
  for (int i = 0; i < 3; ++i) from->publish(Scan{i});
  run(*lost);
  ASSERT_EQ(reported.size(), 1u);
  EXPECT_EQ(reported[0].total_count_change, 2u);
  from->publish(Scan{3});
  run(*lost);
  ASSERT_EQ(reported.size(), 2u);
  EXPECT_EQ(reported[1].total_count_change, 1u);
  EXPECT_EQ(reported[1].total_count, 3u);
}

TEST_F(QosEvents, ReportMissedDeadlinesFromTheFirstMessageOn) {
  const auto scan = subscription(QoS(10).deadline(10ms));
  const auto from = publisher(QoS(10).deadline(10ms));
  std::vector<DeadlineMissedStatus> requested, offered;
  const auto first = event(*scan, requested);
  const auto second = event(*from, offered);
  const auto advance = [&](Nanoseconds time) {
    clock_.advance(time);
    run(*first);
    run(*second);
    return std::pair(requested.size(), offered.size());
  };
  EXPECT_EQ(advance(50ms), std::pair(0ul, 0ul));
  from->publish(Scan{});
  EXPECT_EQ(advance(9ms), std::pair(0ul, 0ul));
  from->publish(Scan{});
  EXPECT_EQ(advance(9ms), std::pair(0ul, 0ul));
  EXPECT_EQ(advance(1ms), std::pair(1ul, 1ul));
  EXPECT_EQ(advance(9ms), std::pair(1ul, 1ul));
  EXPECT_EQ(advance(1ms), std::pair(2ul, 2ul));
  EXPECT_EQ(requested.back().total_count, 2u);
  from->publish(Scan{});
  EXPECT_EQ(advance(9ms), std::pair(2ul, 2ul));
  EXPECT_EQ(advance(31ms), std::pair(3ul, 3ul));
  EXPECT_EQ(offered.back().total_count_change, 4u);
  EXPECT_THAT([&] { event(*subscription(), requested); },
              ThrowsMessage<Error>(HasSubstr("'/scan' has no deadline")));
}

TEST_F(QosEvents, ReportWhichPublisherIsAlive) {
  const auto scan = subscription();
  std::vector<LivelinessChangedStatus> reported;
  const auto liveliness = event(*scan, reported);
  auto from = publisher();
  run(*liveliness);
  ASSERT_EQ(reported.size(), 1u);
  EXPECT_EQ(reported[0].alive_count, 1);
  from.reset();
  run(*liveliness);
  ASSERT_EQ(reported.size(), 2u);
  EXPECT_EQ(reported[1].alive_count_change, -1);
}

// Inside a process a publisher was alive as long as it existed, whatever it promised.
TEST_F(QosEvents, ReportAPublisherThatMustSayThatItIsAlive) {
  const QoS qos = QoS(10).liveliness(Liveliness::manual_by_topic).liveliness_lease_duration(30ms);
  const auto scan = subscription(qos);
  std::vector<std::pair<std::int64_t, std::int64_t>> counts;
  const auto liveliness = here_->create_qos_event<LivelinessChangedStatus>(
      *scan, [&](const LivelinessChangedStatus& status) {
        counts.emplace_back(status.alive_count, status.not_alive_count);
      });
  const auto reported = [&](Nanoseconds time) {
    clock_.advance(time);
    run(*liveliness);
    return std::exchange(counts, {});
  };
  using Counts = std::vector<std::pair<std::int64_t, std::int64_t>>;
  auto from = publisher(qos);
  EXPECT_EQ(reported(0ms), (Counts{{1, 0}}));
  EXPECT_EQ(reported(29ms), Counts());
  from->publish(Scan{});
  EXPECT_EQ(reported(29ms), Counts());
  from->assert_liveliness();
  EXPECT_EQ(reported(29ms), Counts());
  EXPECT_EQ(reported(1ms), (Counts{{0, 1}}));
  EXPECT_EQ(reported(1h), Counts());
  from->publish(Scan{});
  EXPECT_EQ(reported(0ms), (Counts{{1, 0}}));  // at once
  EXPECT_EQ(reported(30ms), (Counts{{0, 1}}));
  from->assert_liveliness();
  EXPECT_EQ(reported(0ms), (Counts{{1, 0}}));
  const auto other = publisher(qos);
  EXPECT_EQ(reported(10ms), (Counts{{2, 0}}));
  other->publish(Scan{});
  EXPECT_EQ(reported(20ms), (Counts{{1, 1}}));
  from.reset();
  EXPECT_EQ(reported(0ms), (Counts{{1, 0}}));
}

TEST_F(QosEvents, MayOutliveTheirEnds) {
  auto scan = subscription(1);
  const auto from = publisher();
  std::vector<MessageLostStatus> reported;
  auto lost = event(*scan, reported);
  scan.reset();
  from->publish(Scan{});
  run(*lost);
  EXPECT_TRUE(reported.empty());
  scan = subscription(1);
  lost = event(*scan, reported);
  lost.reset();
  for (int i = 0; i < 3; ++i) from->publish(Scan{i});
  EXPECT_TRUE(reported.empty());
}

TEST_F(QosEvents, OfAKindGoToTheLastOneAlsoWhenTheOneBeforeGoes) {
  const auto scan = subscription(1);
  const auto from = publisher();
  std::vector<MessageLostStatus> by_first, by_last;
  auto first = event(*scan, by_first);
  const auto last = event(*scan, by_last);
  run(*last);  // what was so before
  first.reset();
  for (int i = 0; i < 2; ++i) from->publish(Scan{i});
  run(*last);
  EXPECT_TRUE(by_first.empty());
  EXPECT_EQ(by_last.size(), 1u);
}

TEST_F(QosEvents, CostThePublisherNoAllocation) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto scan = subscription(QoS(1).deadline(10ms));
  const auto from = publisher(QoS(1).deadline(10ms).lifespan(1s).transient_local());
  std::vector<MessageLostStatus> lost;
  std::vector<DeadlineMissedStatus> missed;
  const auto first = event(*scan, lost);
  const auto second = event(*scan, missed);
  { const ReadSection registers_this_thread; }
  const RealtimeScope scope;
  for (int i = 0; i < 100; ++i) {
    clock_.advance(1ms);
    from->publish(from->borrow_loaned_message());
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

// In a reentrant group two workers read and wrote at once what was reported last: changes were
// reported twice, or never.
TEST_F(QosEvents, ReportEachChangeOnceOnSeveralThreads) {
  const auto group = here_->create_callback_group("reentrant", CallbackGroupType::Reentrant);
  const auto from = publisher();
  std::atomic<std::uint64_t> sum{0};
  const auto event = here_->create_qos_event<MatchedStatus>(
      *from, [&](const MatchedStatus& status) { sum += status.total_count_change; }, group);
  constexpr std::uint64_t kMatches = 20'000;
  std::atomic<bool> is_over{false};
  std::vector<std::thread> workers;
  for (int i = 0; i < 2; ++i) {
    workers.emplace_back([&] {
      while (!is_over) run(*event);
    });
  }
  for (std::uint64_t i = 0; i < kMatches; ++i) from->events()->matched(1);
  is_over = true;
  for (std::thread& worker : workers) worker.join();
  run(*event);
  EXPECT_EQ(sum, kMatches);
}

TEST_F(QosEvents, ReportEachMissedDeadlineOnceOnSeveralThreads) {
  const auto group = here_->create_callback_group("reentrant", CallbackGroupType::Reentrant);
  const auto scan = subscription(QoS(10).deadline(1ms));
  const auto from = publisher(QoS(10).deadline(1ms));
  std::atomic<std::uint64_t> sum{0};
  const auto event = here_->create_qos_event<DeadlineMissedStatus>(
      *scan, [&](const DeadlineMissedStatus& status) { sum += status.total_count_change; }, group);
  from->publish(Scan{});
  std::atomic<bool> is_over{false};
  std::vector<std::thread> workers;
  for (int i = 0; i < 2; ++i) {
    workers.emplace_back([&] {
      while (!is_over) run(*event);
    });
  }
  for (int i = 0; i < 2000; ++i) clock_.advance(1ms);
  is_over = true;
  for (std::thread& worker : workers) worker.join();
  clock_.advance(1ms);
  run(*event);
  EXPECT_EQ(sum, 2001u);
}

}  // namespace
}  // namespace takt::qos_event_test
