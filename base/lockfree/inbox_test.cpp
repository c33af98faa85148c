// Tests of the list that many push to and one takes whole.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/inbox.hpp"

#include <latch>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace takt {
namespace {

struct Letter {
  int sender = 0;
  int number = 0;
  Letter* inbox_next = nullptr;
};

std::vector<int> numbers(Letter* first) {
  std::vector<int> result;
  for (; first != nullptr; first = first->inbox_next) result.push_back(first->number);
  return result;
}

TEST(Inbox, IsEmptyAtFirst) {
  Inbox<Letter> inbox;
  EXPECT_TRUE(inbox.empty());
  EXPECT_EQ(inbox.take_all(), nullptr);
}

TEST(Inbox, GivesAllInOrderOfArrival) {
  Inbox<Letter> inbox;
  Letter letters[] = {{0, 1}, {0, 2}, {0, 3}};
  for (Letter& letter : letters) inbox.push(letter);
  EXPECT_FALSE(inbox.empty());
  EXPECT_EQ(numbers(inbox.take_all()), (std::vector<int>{1, 2, 3}));
  EXPECT_TRUE(inbox.empty());
  EXPECT_EQ(inbox.take_all(), nullptr);
}

TEST(Inbox, TakesALetterAgainThatWasTakenBefore) {
  Inbox<Letter> inbox;
  Letter first{0, 1}, second{0, 2};
  inbox.push(first);
  inbox.push(second);
  ASSERT_EQ(inbox.take_all(), &first);
  inbox.push(second);
  inbox.push(first);
  EXPECT_EQ(numbers(inbox.take_all()), (std::vector<int>{2, 1}));
}

TEST(Inbox, LosesNothingAndKeepsEachSendersOrderWhenManyPushAtOnce) {
  constexpr int kSenders = 4;
  constexpr int kLetters = 5000;
  Inbox<Letter> inbox;
  std::vector<std::vector<Letter>> letters(kSenders, std::vector<Letter>(kLetters));
  std::latch start(kSenders);
  std::vector<std::thread> senders;
  for (int sender = 0; sender < kSenders; ++sender) {
    senders.emplace_back([&, sender] {
      start.arrive_and_wait();
      for (int i = 0; i < kLetters; ++i) {
        Letter& letter = letters[sender][i];
        letter.sender = sender;
        letter.number = i;
        inbox.push(letter);
      }
    });
  }
  std::vector<int> next(kSenders, 0);
  for (int taken = 0; taken < kSenders * kLetters;) {
    for (Letter* letter = inbox.take_all(); letter != nullptr; letter = letter->inbox_next) {
      EXPECT_EQ(letter->number, next[letter->sender]++);
      ++taken;
    }
    std::this_thread::yield();
  }
  for (std::thread& sender : senders) sender.join();
  EXPECT_TRUE(inbox.empty());
  EXPECT_EQ(next, std::vector<int>(kSenders, kLetters));
}

}  // namespace
}  // namespace takt
