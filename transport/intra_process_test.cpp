// Tests of delivery inside the process: matching, order, counts, joining and leaving.
// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/intra_process.hpp"

#include <atomic>
#include <latch>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/testing/eventually.hpp"

namespace takt::intra_process_test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

struct Number {
  int value = 0;
};
TAKT_MESSAGE(Number, "test_msgs/msg/Number", value);
struct Text {
  std::string value;
};
TAKT_MESSAGE(Text, "test_msgs/msg/Text", value);
struct OtherNumber {
  int value = 0;
  int scale = 1;
};
TAKT_MESSAGE(OtherNumber, "test_msgs/msg/Number", value, scale);

template <class T = Number>
Endpoint on(std::string topic, const QoS& qos = {}) {
  return {std::move(topic), &message_type<T>(), qos};
}

class Reader final : public IntraProcessReader, ArrivalListener {
 public:
  explicit Reader(Endpoint endpoint) : IntraProcessReader(std::move(endpoint)) {
    set_listener(this);
    join();
  }
  ~Reader() override { leave(); }

  MessageBlock* take() {
    bool more;
    return IntraProcessReader::take(more);
  }
  std::vector<int> take_values() {
    std::vector<int> values;
    while (MessageBlock* message = take()) {
      values.push_back(static_cast<const Number*>(message->payload())->value);
      message->release();
    }
    return values;
  }
  std::atomic<int> arrivals{0};
  std::atomic<std::size_t> waiting{0};  // when the last one was announced
  bool is_only_taker = false;

 private:
  void announce(const Arrival&) noexcept override {
    arrivals.fetch_add(1);
    waiting.store(ring().size());
  }
  bool takes_here() const noexcept override { return is_only_taker; }
};

class IntraProcessTest : public testing::Test {
 protected:
  static constexpr std::size_t kLoans = 64;
  using Block = LoanedBlock;

  ~IntraProcessTest() override { EXPECT_EQ(loans_at_home(), kLoans); }

  void write(IntraProcessWriter& writer, int value) {
    Block* block = loans_->acquire();
    ASSERT_NE(block, nullptr);
    static_cast<Number*>(block->message())->value = value;
    writer.write(*block);
  }
  std::size_t loans_at_home() {
    std::vector<Block*> blocks;
    while (Block* block = loans_->acquire()) blocks.push_back(block);
    for (Block* block : blocks) Pool<Block>::recycle(*block);
    return blocks.size();
  }

  ManualClock clock_{TimePoint(1h)};
  PoolPtr<Block> loans_ = make_loans(kLoans, kMakerOf<Number>);
};

// On the thread that takes them, messages were announced before they had arrived.
TEST_F(IntraProcessTest, AnnouncesAMessageThatHasArrived) {
  Reader reader(on("/a"));
  IntraProcessWriter writer(on("/a"), clock_);
  for (const bool is_only_taker : {false, true}) {
    reader.is_only_taker = is_only_taker;
    write(writer, 1);
    EXPECT_EQ(reader.waiting, 1u) << is_only_taker;
    write(writer, 2);
    EXPECT_EQ(reader.waiting, 2u) << is_only_taker;
    EXPECT_THAT(reader.take_values(), ElementsAre(1, 2));
  }
}

TEST_F(IntraProcessTest, DeliversToEveryReaderOfTheTopicAndToNoOther) {
  Reader early(on("/a"));
  IntraProcessWriter writer(on("/a"), clock_);
  Reader late(on("/a"));
  Reader elsewhere(on("/b"));
  EXPECT_EQ(writer.reader_count(), 2u);
  write(writer, 1);
  write(writer, 2);
  EXPECT_EQ(early.arrivals, 2);
  EXPECT_EQ(elsewhere.arrivals, 0);
  EXPECT_THAT(early.take_values(), ElementsAre(1, 2));
  EXPECT_THAT(late.take_values(), ElementsAre(1, 2));
  EXPECT_THAT(elsewhere.take_values(), ElementsAre());
}

TEST_F(IntraProcessTest, DeliversFromEveryWriterOfTheTopic) {
  Reader reader(on("/a"));
  IntraProcessWriter first(on("/a"), clock_), second(on("/a"), clock_);
  write(first, 1);
  write(second, 2);
  write(first, 3);
  EXPECT_THAT(reader.take_values(), ElementsAre(1, 2, 3));
}

TEST_F(IntraProcessTest, HandsOutOneMessageToAllReadersWithoutCopies) {
  Reader first(on("/a")), second(on("/a"));
  IntraProcessWriter writer(on("/a"), clock_);
  write(writer, 1);
  MessageBlock* of_first = first.take();
  MessageBlock* of_second = second.take();
  EXPECT_EQ(of_first, of_second);
  of_first->release();
  EXPECT_EQ(loans_at_home(), kLoans - 1);
  of_second->release();
}

TEST_F(IntraProcessTest, TakesBackAMessageThatNobodyWants) {
  IntraProcessWriter writer(on("/a"), clock_);
  EXPECT_EQ(writer.reader_count(), 0u);
  write(writer, 1);
  EXPECT_EQ(loans_at_home(), kLoans);
}

TEST_F(IntraProcessTest, DeliversNothingToAReaderThatLeft) {
  Reader stays(on("/a"));
  Reader leaves(on("/a"));
  IntraProcessWriter writer(on("/a"), clock_);
  leaves.leave();
  EXPECT_EQ(writer.reader_count(), 1u);
  write(writer, 1);
  EXPECT_EQ(leaves.arrivals, 0);
  EXPECT_THAT(stays.take_values(), ElementsAre(1));
  leaves.leave();  // again: nothing happens
  leaves.join();
  write(writer, 2);
  EXPECT_THAT(leaves.take_values(), ElementsAre(2));
}

TEST_F(IntraProcessTest, ReleasesWhatAReaderNeverTook) {
  IntraProcessWriter writer(on("/a"), clock_);
  {
    Reader reader(on("/a"));
    write(writer, 1);
    write(writer, 2);
    EXPECT_EQ(loans_at_home(), kLoans - 2);
  }
  EXPECT_EQ(loans_at_home(), kLoans);
}

TEST_F(IntraProcessTest, LeavesMessagesWithTheReaderWhenTheWriterGoes) {
  Reader reader(on("/a"));
  {
    IntraProcessWriter writer(on("/a"), clock_);
    write(writer, 1);
  }
  EXPECT_THAT(reader.take_values(), ElementsAre(1));
}

TEST_F(IntraProcessTest, CountsExactlyWhatWasExpectedAndDropped) {
  IntraProcessWriter first(on("/a"), clock_);
  write(first, 0);  // before the reader came
  Reader reader(on("/a", 3));
  EXPECT_EQ(reader.expected(), 0u);
  auto second = std::make_unique<IntraProcessWriter>(on("/a"), clock_);
  for (int i = 1; i <= 4; ++i) write(first, i);
  write(*second, 5);
  second.reset();
  EXPECT_EQ(reader.expected(), 5u);
  EXPECT_EQ(reader.dropped(), 2u);
  EXPECT_THAT(reader.take_values(), ElementsAre(3, 4, 5));
  write(first, 6);
  EXPECT_EQ(reader.expected(), 6u);
  EXPECT_EQ(reader.dropped(), 2u);
}

TEST_F(IntraProcessTest, NumbersMessagesInOrderOfPublicationOverAllTopics) {
  Reader reader_a(on("/a")), reader_b(on("/b"));
  IntraProcessWriter a(on("/a"), clock_), b(on("/b"), clock_);
  write(a, 1);
  write(b, 2);
  MessageBlock* first = reader_a.take();
  MessageBlock* second = reader_b.take();
  EXPECT_NE(first->envelope.sequence, 0u);  // which says: none
  EXPECT_EQ(first->envelope.sequence + 1, second->envelope.sequence);
  first->release();
  second->release();
}

TEST_F(IntraProcessTest, StampsMessagesOnlyWhenAReaderWantsTheTime) {
  Reader wants(on("/a")), does_not(on("/a"));
  IntraProcessWriter writer(on("/a"), clock_);
  const auto publish_time = [&] {
    write(writer, 1);
    MessageBlock* message = wants.take();
    const TimePoint time = message->envelope.ready_time;
    message->release();
    does_not.take()->release();
    return time;
  };
  // A message may wait for an executor that measures from when it was sent.
  EXPECT_EQ(publish_time(), clock_.now());
  wants.set_wants_time(false);
  does_not.set_wants_time(false);
  EXPECT_EQ(publish_time(), TimePoint{});
  wants.set_wants_time(true);
  EXPECT_EQ(publish_time(), clock_.now());
  wants.set_wants_time(false);
  EXPECT_EQ(publish_time(), TimePoint{});
}

TEST_F(IntraProcessTest, RefusesAnotherTypeOnTheTopicAndNamesBoth) {
  Reader reader(on<Number>("/a"));
  const auto error = ThrowsMessage<Error>(
      AllOf(HasSubstr("topic '/a' carries test_msgs/msg/Number"),
            HasSubstr("not test_msgs/msg/Text"), HasSubstr("give the topic another name")));
  EXPECT_THAT([&] { IntraProcessWriter(on<Text>("/a"), clock_); }, error);
  EXPECT_THAT([&] { Reader(on<Text>("/a")); }, error);
  IntraProcessWriter writer(on<Number>("/a"), clock_);
  EXPECT_EQ(writer.reader_count(), 1u);  // nothing is left of those that were refused
}

TEST_F(IntraProcessTest, RefusesAnotherLayoutOfATypeOfTheSameName) {
  IntraProcessWriter writer(on<Number>("/a"), clock_);
  EXPECT_THAT([&] { Reader(on<OtherNumber>("/a")); },
              ThrowsMessage<Error>(HasSubstr("build both sides from one definition of the type")));
}

TEST_F(IntraProcessTest, ForgetsTheTypeOfATopicThatNobodyUses) {
  { Reader reader(on<Number>("/a")); }
  { IntraProcessWriter writer(on<Text>("/a"), clock_); }
  EXPECT_NO_THROW(Reader(on<Number>("/a")));
}

TEST_F(IntraProcessTest, RefusesADepthThatCannotBeKept) {
  EXPECT_THROW(Reader(on("/a", 0)), Error);
  EXPECT_THROW(IntraProcessWriter(on("/a", 100'000), clock_), Error);
}

TEST_F(IntraProcessTest, DoesNotMatchABestEffortWriterWithAReliableReaderAndSaysSo) {
  std::vector<std::string> lines;
  Logger::instance().set_writer([&](LogLevel, std::string_view text) { lines.emplace_back(text); });
  {
    Reader reliable(on("/a", QoS().reliable()));
    IntraProcessWriter writer(on("/a", QoS().best_effort()), clock_);
    Reader best_effort(on("/a", QoS().best_effort()));
    EXPECT_EQ(writer.reader_count(), 1u);
    write(writer, 1);
    EXPECT_EQ(reliable.arrivals, 0);
    EXPECT_EQ(reliable.expected(), 0u);
    EXPECT_EQ(best_effort.arrivals, 1);
  }
  Logger::instance().flush();
  Logger::instance().set_writer({});
  EXPECT_THAT(
      lines,
      ElementsAre(
          "topic '/a': the publisher of '' offers less than the subscription of '' asks for: "
          "reliability; no message passes"));
}

TEST_F(IntraProcessTest, KeepsTheLastMessagesForReadersThatComeLate) {
  const auto kept = [](std::size_t depth) { return on("/a", QoS(depth).transient_local()); };
  IntraProcessWriter writer(kept(3), clock_);
  Reader first(kept(10));
  EXPECT_EQ(first.arrivals, 0);
  write(writer, 1);
  write(writer, 2);
  Reader second(kept(10));
  EXPECT_THAT(second.take_values(), ElementsAre(1, 2));
  for (int value = 3; value <= 5; ++value) write(writer, value);
  Reader late(kept(10)), small(kept(2)), indifferent(on("/a", 10));
  write(writer, 6);
  EXPECT_THAT(first.take_values(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(second.take_values(), ElementsAre(3, 4, 5, 6));
  EXPECT_THAT(late.take_values(), ElementsAre(3, 4, 5, 6));
  EXPECT_THAT(small.take_values(), ElementsAre(5, 6));
  EXPECT_EQ(small.dropped(), 1u);  // by the sixth: what it was handed over fitted
  EXPECT_THAT(indifferent.take_values(), ElementsAre(6));
}

TEST_F(IntraProcessTest, KeepsNothingForReadersThatComeWhenTheWriterIsGone) {
  {
    IntraProcessWriter writer(on("/a", QoS(3).transient_local()), clock_);
    write(writer, 1);
  }
  Reader late(on("/a", QoS(3).transient_local()));
  EXPECT_EQ(late.arrivals, 0);
}

// Whenever it comes: without a gap, and nothing twice.
TEST_F(IntraProcessTest, HandsOverToALateReaderWhereWhatIsSentFollows) {
  IntraProcessWriter writer(on("/a", QoS(4).transient_local()), clock_);
  std::atomic<bool> stop{false};
  std::thread writing([&] {
    for (int value = 1; !stop.load();) {
      Block* block = loans_->acquire();
      if (block == nullptr) continue;
      static_cast<Number*>(block->message())->value = value++;
      writer.write(*block);
    }
  });
  for (int round = 0; round < 200; ++round) {
    Reader late(on("/a", QoS(1000).transient_local()));
    EXPECT_TRUE(eventually([&] { return late.arrivals >= 8; }));
    late.leave();
    const std::vector<int> values = late.take_values();
    for (std::size_t i = 1; i < values.size(); ++i) ASSERT_EQ(values[i], values[i - 1] + 1);
  }
  stop.store(true);
  writing.join();
}

TEST_F(IntraProcessTest, DropsWhatIsOlderThanItsLifespan) {
  IntraProcessWriter writer(on("/a", QoS(10).lifespan(100ms)), clock_);
  Reader reader(on("/a"));
  write(writer, 1);
  clock_.advance(60ms);
  write(writer, 2);
  clock_.advance(41ms);
  EXPECT_THAT(reader.take_values(), ElementsAre(2));
  EXPECT_EQ(reader.dropped(), 1u);
  write(writer, 3);
  clock_.advance(101ms);
  EXPECT_THAT(reader.take_values(), testing::IsEmpty());
  EXPECT_EQ(reader.dropped(), 2u);
}

TEST_F(IntraProcessTest, WritesAndTakesWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  Reader reader(on("/a", 2)), other(on("/a", 5));
  IntraProcessWriter writer(on("/a", QoS(3).transient_local().lifespan(1h)), clock_);
  write(writer, 0);  // this thread's first read section allocates
  const RealtimeScope scope;
  for (int i = 0; i < 10; ++i) write(writer, i);
  MessageBlock* message = reader.take();
  message->release();
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

// The test's destructor sees that every message came back, the counts that none came twice.
TEST_F(IntraProcessTest, LosesNoMessageWhileReadersComeAndGo) {
  constexpr int kWriters = 2;
  Reader stays(on("/a", 2));
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> written{0};
  std::latch started(kWriters);
  std::vector<std::thread> writers;
  for (int i = 0; i < kWriters; ++i) {
    writers.emplace_back([&] {
      IntraProcessWriter writer(on("/a"), clock_);
      started.count_down();
      while (!stop.load()) {
        if (Block* block = loans_->acquire()) {
          writer.write(*block);
          written.fetch_add(1);
        }
      }
    });
  }
  started.wait();
  for (int round = 0; round < 100; ++round) {
    Reader guest(on("/a", 3));
    if (MessageBlock* message = guest.take()) message->release();
    guest.leave();
    const int arrivals = guest.arrivals;
    if (MessageBlock* message = stays.take()) message->release();
    EXPECT_EQ(guest.arrivals, arrivals);
    EXPECT_EQ(guest.expected(), static_cast<std::uint64_t>(arrivals));
  }
  stop.store(true);
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(stays.expected(), written);
  EXPECT_EQ(static_cast<std::uint64_t>(stays.arrivals), written);
}

/// A message of this process may own what its publisher likes.
struct Letter {
  int value = 0;
  std::shared_ptr<void> owned;
};
TAKT_MESSAGE(Letter, "test_msgs/msg/Letter", value);

void write_letter(IntraProcessWriter& writer, std::shared_ptr<void> owned) {
  auto block = std::make_unique<OwnedBlock>();
  block->from_heap = true;
  block->own(std::make_unique<Letter>(Letter{0, std::move(owned)}));
  writer.write(*block.release());
}

// A message that was overwritten, or had no reader, was destroyed within the read section of its
// publication: a reader that it owns waited there for the end of this very section.
TEST(Messages, MayOwnReadersWhenTheyAreOverwritten) {
  ManualClock clock(TimePoint(1h));
  IntraProcessWriter writer(on<Letter>("/letters"), clock), lonely(on<Letter>("/nobody"), clock);
  Reader reader(on<Letter>("/letters", 1));
  auto other = std::make_shared<Reader>(on<Letter>("/other"));
  const std::weak_ptr<Reader> of_first = other;
  write_letter(writer, std::move(other));
  write_letter(writer, nullptr);
  EXPECT_TRUE(of_first.expired());
  write_letter(lonely, std::make_shared<Reader>(on<Letter>("/letters")));
  EXPECT_EQ(writer.reader_count(), 1u);
}

// The same under the lock of the messages that a publisher keeps for late readers.
TEST(Messages, MayOwnReadersWhenTheyAreNotKeptAnyMore) {
  ManualClock clock(TimePoint(1h));
  IntraProcessWriter writer(on<Letter>("/kept", QoS(1).transient_local()), clock);
  auto other = std::make_shared<Reader>(on<Letter>("/kept", QoS(1).transient_local()));
  const std::weak_ptr<Reader> of_first = other;
  write_letter(writer, nullptr);
  other->take()->release();
  write_letter(writer, nullptr);
  write_letter(writer, std::move(other));  // overwrites one in the ring that it owns
  EXPECT_FALSE(of_first.expired());
  of_first.lock()->take()->release();
  write_letter(writer, nullptr);  // takes the place of that letter, whose reader keeps this one
  EXPECT_TRUE(of_first.expired());
  EXPECT_EQ(writer.reader_count(), 0u);
}

}  // namespace
}  // namespace takt::intra_process_test
