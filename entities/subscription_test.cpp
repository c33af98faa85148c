// Tests of receiving: the forms of callback, what owns the message, what is counted.
// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/subscription.hpp"

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/nodes/node.hpp"

namespace takt::subscription_test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* kNotCounted = "a sanitizer has taken malloc over";

struct Scan {
  int id = 0;
};
TAKT_MESSAGE(Scan, "test_msgs/msg/Scan", id);
struct Image {
  std::vector<std::uint8_t> data;
};
TAKT_MESSAGE(Image, "test_msgs/msg/Image", data);

class CountingSink final : public Sink {
 public:
  explicit CountingSink(bool wants_time) : wants_time_(wants_time) {}
  void announce(const Arrival& arrival) noexcept override { sequences.push_back(arrival.sequence); }
  void release_changed() noexcept override {}
  void remove() noexcept override {}
  void expect_remove() noexcept override {}
  bool wants_time() const noexcept override { return wants_time_; }

  std::vector<std::uint64_t> sequences;

 private:
  const bool wants_time_;
};

class SubscriptionTest : public testing::Test {
 protected:
  template <class F>
  auto subscribe(F callback, const QoS& qos = 10) {
    return node_->create_subscription<Scan>("scan", qos, std::move(callback));
  }
  auto publisher(std::size_t loans = 0) {
    return node_->create_publisher<Scan>("scan", 10, {.loans = loans});
  }
  static int run_all(Entity& entity) {
    int count = 0;
    for (Slot slot; entity.take(slot); ++count) entity.execute(slot);
    return count;
  }
  /// Publishes a loan and returns where it lies.
  static const Scan* publish_loan(Publisher<Scan>& publisher, int id = 0) {
    LoanedMessage<Scan> loan = publisher.borrow_loaned_message();
    loan->id = id;
    const Scan* address = &*loan;
    publisher.publish(std::move(loan));
    return address;
  }

  ManualClock clock_{TimePoint(1h)};
  std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
};

TEST_F(SubscriptionTest, KnowsWhatItIs) {
  const auto scans = node_->create_subscription<Scan>("~/scan", 10, [](const Scan&) {});
  EXPECT_EQ(scans->kind(), EntityKind::subscription);
  EXPECT_EQ(scans->name(), "~/scan");  // as the node wrote it
  EXPECT_EQ(scans->topic(), "/node/scan");
  EXPECT_EQ(scans->group(), node_->default_callback_group());
}

// ---- const T& ----

TEST_F(SubscriptionTest, LooksAtTheMessageWhereItLiesAndGivesItBack) {
  const auto scans = publisher(1);
  std::vector<const Scan*> seen;
  const auto first = subscribe([&](const Scan& scan) { seen.push_back(&scan); });
  const auto second = subscribe([&](const Scan& scan) { seen.push_back(&scan); });
  const Scan* address = publish_loan(*scans);
  EXPECT_EQ(run_all(*first) + run_all(*second), 2);
  EXPECT_THAT(seen, ElementsAre(address, address));
  EXPECT_TRUE(scans->borrow_loaned_message());
}

TEST_F(SubscriptionTest, LooksWithoutAllocatingWhateverWasPublished) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  const auto scans = publisher(1);
  int sum = 0;
  const auto looks = subscribe([&](const Scan& scan) { sum += scan.id; });
  publish_loan(*scans, 1);
  scans->publish(std::make_unique<Scan>(Scan{.id = 2}));
  scans->publish(std::make_shared<const Scan>(Scan{.id = 3}));
  const RealtimeScope scope;
  const int runs = run_all(*looks);
  EXPECT_EQ(scope.so_far().allocations, 0u);
  EXPECT_EQ(runs, 3);
  EXPECT_EQ(sum, 6);
}

TEST_F(SubscriptionTest, GivesTheMessageBackWhenTheCallbackThrows) {
  const auto scans = publisher(1);
  const auto throws = subscribe([](const Scan&) { throw std::runtime_error("broken"); });
  publish_loan(*scans);
  Slot slot;
  ASSERT_TRUE(throws->take(slot));
  EXPECT_THROW(throws->execute(slot), std::runtime_error);
  EXPECT_TRUE(scans->borrow_loaned_message());
}

// ---- std::shared_ptr<const T> ----

TEST_F(SubscriptionTest, SharesAPublishedSharedPtrWithAllAtOneAddress) {
  const auto scans = publisher();
  std::vector<std::shared_ptr<const Scan>> kept;
  const auto keep = [&](std::shared_ptr<const Scan> scan) { kept.push_back(std::move(scan)); };
  const auto first = subscribe(keep), second = subscribe(keep);
  const auto message = std::make_shared<const Scan>(Scan{.id = 5});
  scans->publish(message);
  EXPECT_EQ(run_all(*first) + run_all(*second), 2);
  EXPECT_THAT(kept, ElementsAre(message, message));
  EXPECT_EQ(message.use_count(), 3);  // ours and theirs; nothing is left in between
}

TEST_F(SubscriptionTest, SharesALoanUntilTheLastPointerGoes) {
  const auto scans = publisher(1);
  std::shared_ptr<const Scan> kept;
  const auto keeps = subscribe([&](const std::shared_ptr<const Scan>& scan) { kept = scan; });
  const Scan* address = publish_loan(*scans);
  EXPECT_EQ(run_all(*keeps), 1);
  EXPECT_EQ(kept.get(), address);
  EXPECT_FALSE(scans->borrow_loaned_message());
  kept.reset();
  EXPECT_TRUE(scans->borrow_loaned_message());
}

TEST_F(SubscriptionTest, SharesWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << kNotCounted;
  constexpr int kKept = 10 + 16;  // depth + 16
  const auto scans = publisher(kKept);
  std::vector<std::shared_ptr<const Scan>> kept;
  kept.reserve(kKept);
  const auto keeps =
      subscribe([&](std::shared_ptr<const Scan> scan) { kept.push_back(std::move(scan)); });
  publish_loan(*scans);
  run_all(*keeps);
  kept.clear();
  const RealtimeScope scope;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < kKept; ++i) {
      publish_loan(*scans, i);
      run_all(*keeps);
    }
    kept.clear();
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

TEST_F(SubscriptionTest, SharesMoreMessagesThanItHasControlBlocksFor) {
  constexpr int kKept = 10 + 16 + 20;
  const auto scans = publisher(kKept);
  std::vector<std::shared_ptr<const Scan>> kept;
  const auto keeps =
      subscribe([&](std::shared_ptr<const Scan> scan) { kept.push_back(std::move(scan)); });
  for (int i = 0; i < kKept; ++i) {
    publish_loan(*scans, i);
    run_all(*keeps);
  }
  ASSERT_EQ(kept.size(), std::size_t{kKept});
  for (int i = 0; i < kKept; ++i) EXPECT_EQ(kept[static_cast<std::size_t>(i)]->id, i);
  kept.clear();
  EXPECT_TRUE(scans->borrow_loaned_message());
}

// With the address sanitizer: nothing that the kept pointers need may be freed before them.
TEST_F(SubscriptionTest, LetsKeptPointersOutliveSubscriptionPublisherAndNode) {
  auto scans = publisher(1);
  std::vector<std::shared_ptr<const Scan>> kept;
  auto keeps =
      subscribe([&](std::shared_ptr<const Scan> scan) { kept.push_back(std::move(scan)); });
  publish_loan(*scans, 1);
  scans->publish(std::make_unique<Scan>(Scan{.id = 2}));
  scans->publish(std::make_shared<const Scan>(Scan{.id = 3}));
  EXPECT_EQ(run_all(*keeps), 3);
  keeps.reset();
  scans.reset();
  node_.reset();
  EXPECT_EQ(kept[0]->id, 1);
  EXPECT_EQ(kept[1]->id, 2);
  EXPECT_EQ(kept[2]->id, 3);
  const std::weak_ptr<const Scan> watched = kept[2];
  kept.clear();
  EXPECT_TRUE(watched.expired());
}

// ---- std::unique_ptr<T> ----

TEST_F(SubscriptionTest, IsGivenTheUniquePtrItselfWhenItIsAlone) {
  const auto scans = publisher();
  std::unique_ptr<Scan> owned;
  const auto owns = subscribe([&](std::unique_ptr<Scan> scan) { owned = std::move(scan); });
  auto message = std::make_unique<Scan>(Scan{.id = 8});
  const Scan* address = message.get();
  scans->publish(std::move(message));
  EXPECT_EQ(run_all(*owns), 1);
  EXPECT_EQ(owned.get(), address);
  EXPECT_EQ(owned->id, 8);
}

TEST_F(SubscriptionTest, IsGivenACopyOfTheUniquePtrUnlessItIsTheLast) {
  const auto scans = publisher();
  std::vector<std::unique_ptr<Scan>> owned;
  const auto own = [&](std::unique_ptr<Scan> scan) { owned.push_back(std::move(scan)); };
  const auto first = subscribe(own), second = subscribe(own), third = subscribe(own);
  auto message = std::make_unique<Scan>(Scan{.id = 8});
  const Scan* address = message.get();
  scans->publish(std::move(message));
  EXPECT_EQ(run_all(*first) + run_all(*second) + run_all(*third), 3);
  ASSERT_EQ(owned.size(), 3u);
  EXPECT_NE(owned[0].get(), address);
  EXPECT_NE(owned[1].get(), address);
  EXPECT_EQ(owned[2].get(), address);
  for (const auto& scan : owned) EXPECT_EQ(scan->id, 8);
}

TEST_F(SubscriptionTest, IsGivenACopyOfWhatIsNotTheCallbacksToOwn) {
  const auto scans = publisher(1);
  std::vector<std::unique_ptr<Scan>> owned;
  const auto owns =
      subscribe([&](std::unique_ptr<Scan> scan) { owned.push_back(std::move(scan)); });
  const Scan* loan = publish_loan(*scans, 1);
  const auto shared = std::make_shared<const Scan>(Scan{.id = 2});
  scans->publish(shared);
  EXPECT_EQ(run_all(*owns), 2);
  EXPECT_NE(owned[0].get(), loan);
  EXPECT_NE(owned[1].get(), shared.get());
  EXPECT_EQ(owned[0]->id + owned[1]->id, 3);
  EXPECT_EQ(shared.use_count(), 1);
  EXPECT_TRUE(scans->borrow_loaned_message());
}

TEST_F(SubscriptionTest, MixesAllFormsOnOneTopic) {
  const auto scans = publisher();
  int looked = 0;
  std::shared_ptr<const Scan> kept;
  std::unique_ptr<Scan> owned;
  const auto looks = subscribe([&](const Scan& scan) { looked = scan.id; });
  const auto keeps = subscribe([&](std::shared_ptr<const Scan> scan) { kept = std::move(scan); });
  const auto owns = subscribe([&](std::unique_ptr<Scan> scan) { owned = std::move(scan); });
  auto message = std::make_unique<Scan>(Scan{.id = 6});
  const Scan* address = message.get();
  scans->publish(std::move(message));
  run_all(*looks);
  run_all(*keeps);
  run_all(*owns);  // the last, but a pointer is still kept
  EXPECT_EQ(looked, 6);
  EXPECT_EQ(kept.get(), address);
  EXPECT_NE(owned.get(), address);
  EXPECT_EQ(owned->id, 6);
}

// ---- MessageInfo ----

TEST_F(SubscriptionTest, PassesMessageInfoToEachFormOfCallback) {
  const auto scans = publisher();
  std::vector<MessageInfo> infos;
  const auto looks =
      subscribe([&](const Scan&, const MessageInfo& info) { infos.push_back(info); });
  const auto keeps = subscribe(
      [&](std::shared_ptr<const Scan>, const MessageInfo& info) { infos.push_back(info); });
  const auto owns =
      subscribe([&](std::unique_ptr<Scan>, const MessageInfo& info) { infos.push_back(info); });
  CountingSink sink(/*wants_time=*/true);
  looks->attach(sink);
  scans->publish(Scan{});
  clock_.advance(5ms);
  EXPECT_EQ(run_all(*looks) + run_all(*keeps) + run_all(*owns), 3);
  for (const MessageInfo& info : infos) {
    EXPECT_EQ(info.sequence, sink.sequences.at(0));
    EXPECT_EQ(info.publish_time, clock_.now() - 5ms);
    EXPECT_EQ(info.root_release, TimePoint{});
  }
  looks->detach();
}

// ---- Without an executor ----

TEST_F(SubscriptionTest, IsTakenFromByCopy) {
  const auto scans = publisher(1);
  const auto subscription = subscribe([](const Scan&) { FAIL() << "nobody executes it"; });
  Scan scan;
  EXPECT_FALSE(subscription->take(scan));
  publish_loan(*scans, 4);
  EXPECT_TRUE(subscription->take(scan));
  EXPECT_EQ(scan.id, 4);
  EXPECT_FALSE(subscription->take(scan));
  EXPECT_TRUE(scans->borrow_loaned_message());
}

// ---- Readiness and counts ----

TEST_F(SubscriptionTest, AnnouncesEachMessageWhileItIsAttached) {
  const auto scans = publisher();
  const auto subscription = subscribe([](const Scan&) {});
  CountingSink sink(/*wants_time=*/false);
  scans->publish(Scan{});
  subscription->attach(sink);
  scans->publish(Scan{});
  scans->publish(Scan{});
  subscription->detach();
  scans->publish(Scan{});
  EXPECT_EQ(sink.sequences.size(), 2u);
  EXPECT_LT(sink.sequences[0], sink.sequences[1]);
  EXPECT_EQ(subscription->ready_count(), 4u);
}

TEST_F(SubscriptionTest, HasMessagesStampedOnlyForASinkThatWantsTime) {
  const auto scans = publisher();
  const auto subscription = subscribe([](const Scan&) {});
  const auto ready_time = [&] {
    scans->publish(Scan{});
    Slot slot;
    EXPECT_TRUE(subscription->take(slot));
    subscription->execute(slot);
    return slot.ready_time;
  };
  CountingSink spares(/*wants_time=*/false), wants(/*wants_time=*/true);
  subscription->attach(spares);
  EXPECT_EQ(ready_time(), TimePoint{});
  subscription->detach();
  subscription->attach(wants);
  EXPECT_EQ(ready_time(), clock_.now());
  subscription->detach();
  EXPECT_EQ(ready_time(), TimePoint{});
}

TEST_F(SubscriptionTest, ReportsWhatWouldBeTakenNext) {
  const auto scans = publisher();
  const auto subscription = subscribe([](const Scan&) {});
  CountingSink sink(/*wants_time=*/true);
  subscription->attach(sink);
  Arrival arrival;
  EXPECT_FALSE(subscription->front(arrival));
  const TimePoint first_time = clock_.now();
  scans->publish(Scan{});
  clock_.advance(1ms);
  scans->publish(Scan{});
  ASSERT_TRUE(subscription->front(arrival));
  EXPECT_EQ(arrival.sequence, sink.sequences[0]);
  EXPECT_EQ(arrival.ready_time, first_time);
  Slot slot;
  ASSERT_TRUE(subscription->take(slot));
  EXPECT_TRUE(slot.more);
  EXPECT_EQ(slot.sequence, arrival.sequence);
  subscription->execute(slot);
  ASSERT_TRUE(subscription->take(slot));
  EXPECT_FALSE(slot.more);
  EXPECT_EQ(slot.sequence, sink.sequences[1]);
  subscription->execute(slot);
  subscription->detach();
}

TEST_F(SubscriptionTest, KeepsTheNewestAndCountsExactlyWhatWasExpectedAndDropped) {
  auto scans = publisher(8);
  std::vector<int> seen;
  const auto subscription = subscribe([&](const Scan& scan) { seen.push_back(scan.id); }, 3);
  for (int i = 1; i <= 5; ++i) publish_loan(*scans, i);
  EXPECT_EQ(subscription->ready_count(), 3u);
  EXPECT_EQ(subscription->dropped(), 2u);
  EXPECT_EQ(run_all(*subscription), 3);
  EXPECT_THAT(seen, ElementsAre(3, 4, 5));
  publish_loan(*scans, 6);
  scans.reset();  // what it sent still counts
  const Entity::Counts counts = subscription->counts();
  EXPECT_EQ(subscription->topic(), "/scan");
  EXPECT_EQ(counts.expected, 6u);
  EXPECT_EQ(counts.dropped, 2u);
}

TEST_F(SubscriptionTest, GivesBackDroppedAndUntakenMessages) {
  const auto scans = publisher(2);
  {
    const auto subscription = subscribe([](const Scan&) {}, 1);
    publish_loan(*scans);
    publish_loan(*scans);  // drops the first
    EXPECT_TRUE(scans->borrow_loaned_message());
  }
  const LoanedMessage<Scan> first = scans->borrow_loaned_message();
  const LoanedMessage<Scan> second = scans->borrow_loaned_message();
  EXPECT_TRUE(first);
  EXPECT_TRUE(second);
}

// ---- Matching ----

TEST_F(SubscriptionTest, IsRefusedOnATopicOfAnotherTypeWithBothTypesNamed) {
  const auto scans = publisher();
  EXPECT_THAT(
      [&] { (void)node_->create_subscription<Image>("scan", 10, [](const Image&) {}); },
      ThrowsMessage<Error>(AllOf(HasSubstr("topic '/scan'"), HasSubstr("test_msgs/msg/Scan"),
                                 HasSubstr("test_msgs/msg/Image"))));
  EXPECT_THROW((void)node_->create_publisher<Image>("scan", 10), Error);
  EXPECT_TRUE(node_->entities().empty());
  EXPECT_EQ(scans->subscription_count(), 0u);
}

TEST_F(SubscriptionTest, IsNotMatchedWithAPublisherThatOffersLess) {
  Logger::instance().set_level(LogLevel::error);  // the warning is tested with the transport
  const auto best_effort = node_->create_publisher<Scan>("scan", QoS(10).best_effort());
  const auto asks_more = subscribe([](const Scan&) {}, QoS(10).reliable());
  const auto asks_same = subscribe([](const Scan&) {}, QoS(10).best_effort());
  Logger::instance().set_level(LogLevel::info);
  EXPECT_EQ(best_effort->subscription_count(), 1u);
  best_effort->publish(Scan{});
  EXPECT_EQ(asks_more->ready_count(), 0u);
  EXPECT_EQ(asks_more->expected(), 0u);
  EXPECT_EQ(asks_same->ready_count(), 1u);
}

struct Fragile {
  int id = 0;
  Fragile() = default;
  Fragile(const Fragile&) = default;
  Fragile& operator=(const Fragile& other) {
    if (other.id == 13) throw std::runtime_error("mine");
    id = other.id;
    return *this;
  }
};
TAKT_MESSAGE(Fragile, "test_msgs/msg/Fragile", id);

// The message was never given back when its copy threw.
TEST(SubscriptionTakes, GivesAMessageBackWhoseCopyThrows) {
  Node node("node");
  const auto subscription = node.create_subscription<Fragile>("t", 1, [](const Fragile&) {});
  const auto publisher = node.create_publisher<Fragile>("t", 1, {.loans = 1});
  auto loan = publisher->borrow_loaned_message();
  loan->id = 13;
  publisher->publish(std::move(loan));
  Fragile message;
  EXPECT_THROW(subscription->take(message), std::runtime_error);
  EXPECT_TRUE(publisher->borrow_loaned_message());
}

}  // namespace
}  // namespace takt::subscription_test
