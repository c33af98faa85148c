// Tests of publishing: loans, owned messages, and what travels with them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/publisher.hpp"

#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* kNotCounted = "a sanitizer has taken malloc over";

struct Scan {
  int id = 0;
  std::vector<int> ranges;
};
TAKT_MESSAGE(Scan, "test_msgs/msg/Scan", id, ranges);

class PublisherTest : public testing::Test {
 protected:
  auto publisher(PublisherOptions<Scan> options = {}, const QoS& qos = 10) {
    return node_->create_publisher<Scan>("scan", qos, std::move(options));
  }
  /// A subscription that notes the ids that it is given.
  auto subscription(const QoS& qos = 10) {
    return node_->create_subscription<Scan>("scan", qos,
                                            [this](const Scan& scan) { ids_.push_back(scan.id); });
  }
  static int run_all(Entity& entity) {
    int count = 0;
    for (Slot slot; entity.take(slot); ++count) entity.execute(slot);
    return count;
  }

  ManualClock clock_{TimePoint(1h)};
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<int> ids_;
};

TEST_F(PublisherTest, KnowsItsTopicAndHowManySubscriptionsItServes) {
  const auto scans = publisher();
  EXPECT_EQ(scans->topic(), "/scan");
  EXPECT_EQ(scans->subscription_count(), 0u);
  auto first = subscription();
  const auto second = subscription();
  EXPECT_EQ(scans->subscription_count(), 2u);
  first.reset();
  EXPECT_EQ(scans->subscription_count(), 1u);
}

/// Copying it takes a second.
struct Long {
  struct Copied {
    Copied() = default;
    Copied(const Copied&) { clock->work(1s); }
    Copied& operator=(const Copied&) {
      clock->work(1s);
      return *this;
    }
  };
  int id = 0;
  Copied content;
  static inline ManualClock* clock = nullptr;
};
TAKT_MESSAGE(Long, "test_msgs/msg/Long", id);

// The time was read when all was done but to send it: what `publish` copies was no latency.
TEST_F(PublisherTest, TheTimeOfAMessageIsFromBeforePublishDoesAnything) {
  Long::clock = &clock_;
  const auto subscription = node_->create_subscription<Long>("long", 10, [](const Long&) {});
  subscription->set_wants_time(true);
  for (const std::size_t loans : {0, 1}) {
    const auto publisher = node_->create_publisher<Long>("long", 10, {.loans = loans});
    const Long message{.id = 1};
    for (int i = 0; i < 2; ++i) {
      const TimePoint before = clock_.now();
      publisher->publish(message);
      EXPECT_EQ(clock_.now(), before + 1s);
      Slot slot;
      ASSERT_TRUE(subscription->take(slot));
      EXPECT_EQ(slot.ready_time, before);
      subscription->discard(slot);
    }
  }
}

TEST_F(PublisherTest, ReadsNoClockForReadersThatWantNoTime) {
  const auto scans = publisher();
  const auto reader = subscription();
  for (const bool wants : {false, true, false}) {
    reader->set_wants_time(wants);
    scans->publish(Scan{});
    Slot slot;
    ASSERT_TRUE(reader->take(slot));
    EXPECT_EQ(slot.ready_time, wants ? clock_.now() : TimePoint{});
    reader->discard(slot);
  }
}

// ---- Loans ----

TEST_F(PublisherTest, LendsAsManyMessagesAsItHas) {
  const auto scans = publisher({.loans = 2});
  const LoanedMessage<Scan> first = scans->borrow_loaned_message();
  LoanedMessage<Scan> second = scans->borrow_loaned_message();
  EXPECT_TRUE(first);
  EXPECT_TRUE(second);
  EXPECT_FALSE(scans->borrow_loaned_message());
  second = LoanedMessage<Scan>();  // goes back unpublished
  EXPECT_TRUE(scans->borrow_loaned_message());
}

TEST_F(PublisherTest, RefusesToLendWhenItWasMadeWithoutLoans) {
  const auto scans = publisher();
  EXPECT_THAT([&] { scans->borrow_loaned_message(); },
              ThrowsMessage<Error>("publisher of '/scan' has no messages to lend; give "
                                   "PublisherOptions::loans when you create it"));
}

TEST_F(PublisherTest, LendsMessagesThatLookLikeThePrototype) {
  const auto scans = publisher(
      {.loans = 1, .prototype = std::make_shared<const Scan>(Scan{.id = 7, .ranges = {1, 2, 3}})});
  const LoanedMessage<Scan> loan = scans->borrow_loaned_message();
  EXPECT_EQ(loan->id, 7);
  EXPECT_THAT((*loan).ranges, ElementsAre(1, 2, 3));
}

TEST_F(PublisherTest, LendsWhatTheLastUserWroteWithItsMemory) {
  const auto scans = publisher({.loans = 1});
  LoanedMessage<Scan> loan = scans->borrow_loaned_message();
  loan->ranges.assign(100, 5);
  const int* memory = loan->ranges.data();
  scans->publish(std::move(loan));  // to nobody: it is back at once
  loan = scans->borrow_loaned_message();
  ASSERT_TRUE(loan);
  EXPECT_EQ(loan->ranges.data(), memory);
  EXPECT_EQ(loan->ranges.size(), 100u);
}

TEST_F(PublisherTest, MovesALoanSoThatOnlyOneHoldsIt) {
  const auto scans = publisher({.loans = 1});
  LoanedMessage<Scan> loan = scans->borrow_loaned_message();
  LoanedMessage<Scan> moved = std::move(loan);
  EXPECT_FALSE(loan);  // NOLINT(bugprone-use-after-move): what is tested
  EXPECT_TRUE(moved);
  scans->publish(std::move(moved));
  EXPECT_FALSE(moved);  // NOLINT(bugprone-use-after-move): what is tested
  scans->publish(LoanedMessage<Scan>());
  EXPECT_TRUE(scans->borrow_loaned_message());
}

TEST_F(PublisherTest, GetsALoanBackWhenTheLastSubscriptionHasRun) {
  const auto scans = publisher({.loans = 1});
  const auto first = subscription(), second = subscription();
  scans->publish(scans->borrow_loaned_message());
  run_all(*first);
  EXPECT_FALSE(scans->borrow_loaned_message());
  run_all(*second);
  EXPECT_TRUE(scans->borrow_loaned_message());
}

TEST_F(PublisherTest, PublishesLoansWithoutAllocatingInTheSteadyState) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  ids_.reserve(100);
  const auto scans =
      publisher({.loans = 4,
                 .prototype = std::make_shared<const Scan>(Scan{.ranges = std::vector<int>(50)})});
  const auto first = subscription(), second = subscription(2);
  scans->publish(scans->borrow_loaned_message());  // this thread's first read section allocates
  const RealtimeScope scope;
  for (int i = 0; i < 20; ++i) {
    LoanedMessage<Scan> loan = scans->borrow_loaned_message();
    loan->id = i;
    loan->ranges.assign(50, i);
    scans->publish(std::move(loan));
    run_all(*first);
    run_all(*second);
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(ids_.size(), 42u);
}

// ---- Messages of the user ----

TEST_F(PublisherTest, AddsNoAllocationToMessagesThatTheUserMade) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  ids_.reserve(100);
  const auto scans = publisher();
  const auto served = subscription();
  scans->publish(std::make_unique<Scan>());
  std::vector<std::unique_ptr<Scan>> unique;
  for (int i = 0; i < 10; ++i) unique.push_back(std::make_unique<Scan>());
  const auto shared = std::make_shared<const Scan>();
  const RealtimeScope scope;
  for (std::unique_ptr<Scan>& message : unique) {
    scans->publish(std::move(message));
    scans->publish(shared);
    run_all(*served);
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(ids_.size(), 21u);
}

TEST_F(PublisherTest, DeliversMoreOwnedMessagesThanItHasWrappersFor) {
  constexpr int kMessages = 50;  // wrappers: depth + 16
  const auto scans = publisher({}, 1);
  const auto served = subscription(kMessages);
  std::vector<int> expected;
  for (int i = 0; i < kMessages; ++i) {
    scans->publish(std::make_unique<Scan>(Scan{.id = i}));
    expected.push_back(i);
  }
  EXPECT_EQ(run_all(*served), kMessages);
  EXPECT_EQ(ids_, expected);
}

TEST_F(PublisherTest, CopiesAReferenceIntoALoanWhileThereIsOneAndElseToTheHeap) {
  const auto scans = publisher({.loans = 1});
  const auto served = subscription();
  Scan scan{.id = 1};
  scans->publish(scan);
  EXPECT_FALSE(scans->borrow_loaned_message());
  scan.id = 2;
  scans->publish(scan);
  scan.id = 3;
  EXPECT_EQ(run_all(*served), 2);
  EXPECT_THAT(ids_, ElementsAre(1, 2));
  EXPECT_TRUE(scans->borrow_loaned_message());
}

TEST_F(PublisherTest, CopiesAReferenceWithoutLoansToo) {
  const auto scans = publisher();
  const auto served = subscription();
  scans->publish(Scan{.id = 4});
  run_all(*served);
  EXPECT_THAT(ids_, ElementsAre(4));
}

TEST_F(PublisherTest, CopiesToWhereACopyBeforeItWas) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  ids_.reserve(100);
  const auto scans = publisher();
  const auto served = subscription();
  const Scan scan{.ranges = std::vector<int>(50)};
  const auto round = [&] {
    for (int i = 0; i < 3; ++i) scans->publish(scan);  // so many are in transit
    run_all(*served);
  };
  round();
  const RealtimeScope scope;
  for (int i = 0; i < 10; ++i) round();
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(ids_.size(), 33u);
}

TEST_F(PublisherTest, RefusesNullMessages) {
  const auto scans = publisher();
  const auto error = ThrowsMessage<Error>(HasSubstr("a null message was published on '/scan'"));
  EXPECT_THAT([&] { scans->publish(std::unique_ptr<Scan>()); }, error);
  EXPECT_THAT([&] { scans->publish(std::shared_ptr<const Scan>()); }, error);
}

TEST_F(PublisherTest, RefusesADepthThatCannotBeKept) {
  EXPECT_THAT([&] { publisher({}, 0); },
              ThrowsMessage<Error>(HasSubstr("a history of 0 messages cannot be kept")));
}

// ---- What travels with a message ----

TEST_F(PublisherTest, StartsNoChainOutsideCallbacks) {
  const auto scans = publisher();
  const auto served = subscription();
  scans->publish(Scan{});
  Slot slot;
  ASSERT_TRUE(served->take(slot));
  EXPECT_EQ(slot.chain_instance, 0u);
  EXPECT_EQ(slot.root_release, TimePoint{});
  EXPECT_EQ(slot.expected_period, 0ns);
  served->execute(slot);
}

TEST_F(PublisherTest, PassesOnTheChainOfTheCallbackThatItIsCalledIn) {
  const auto scans = publisher({.expected_period = 10ms});
  const auto served = subscription();
  const CallbackInfo info;
  {
    Dispatch outer{&info, 41, TimePoint(1s), 6};
    const Dispatch::Scope outer_scope(outer);
    {
      Dispatch dispatch{&info, 42, TimePoint(2s), 7};
      const Dispatch::Scope scope(dispatch);
      scans->publish(Scan{});
    }
    EXPECT_EQ(Dispatch::current(), &outer);
  }
  EXPECT_EQ(Dispatch::current(), nullptr);
  Slot slot;
  ASSERT_TRUE(served->take(slot));
  EXPECT_EQ(slot.chain_instance, 42u);
  EXPECT_EQ(slot.path, 7u);
  EXPECT_EQ(slot.root_release, TimePoint(2s));
  EXPECT_EQ(slot.expected_period, 10ms);
  served->execute(slot);
}

TEST_F(PublisherTest, LeavesItsMessagesUsableWhenItGoes) {
  const auto served = subscription();
  {
    const auto scans = publisher({.loans = 2});
    LoanedMessage<Scan> loan = scans->borrow_loaned_message();
    loan->id = 1;
    scans->publish(std::move(loan));
    scans->publish(std::make_unique<Scan>(Scan{.id = 2}));
  }
  EXPECT_EQ(run_all(*served), 2);
  EXPECT_THAT(ids_, ElementsAre(1, 2));
}

}  // namespace
}  // namespace takt
