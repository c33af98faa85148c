// Tests of how errors read.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/error.hpp"

#include <cerrno>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace takt {
namespace {

const std::vector<std::string> kSchedulers{"chain_priority", "fifo", "ros"};

TEST(Error, SaysWhereWhatAndWhatToDo) {
  EXPECT_STREQ(Error("depth is 0", "choose 1", "a.yaml:3").what(),
               "a.yaml:3: depth is 0; choose 1");
}

TEST(Error, LeavesOutWhatIsNotGiven) {
  EXPECT_STREQ(Error("depth is 0").what(), "depth is 0");
  EXPECT_STREQ(Error("depth is 0", "choose 1").what(), "depth is 0; choose 1");
  EXPECT_STREQ(Error("depth is 0", "", "a.yaml:3").what(), "a.yaml:3: depth is 0");
}

// A zero byte in what was quoted ended the message, so that the advice was lost.
TEST(Error, EscapesWhatItQuotes) {
  EXPECT_STREQ(Error(std::string("a line '\0\x1b'", 11), "write text", "a.msg").what(),
               "a.msg: a line '\\u0000\\u001b'; write text");
}

TEST(Suggest, NamesTheClosestWordAndAllOthers) {
  EXPECT_EQ(suggest("fivo", kSchedulers), "did you mean 'fifo'? valid: chain_priority, fifo, ros");
  EXPECT_EQ(suggest("chain_priorty", kSchedulers),
            "did you mean 'chain_priority'? valid: chain_priority, fifo, ros");
}

TEST(Suggest, CountsInsertedAndLeftOutAndChangedLetters) {
  const std::vector<std::string> valid{"kitten"};
  EXPECT_EQ(suggest("sitting", valid), "did you mean 'kitten'? valid: kitten");  // 3 of 7
  EXPECT_EQ(suggest("sittings", valid), "valid: kitten");  // 4 of 8: more than 1 + 8 / 3
}

// "rnu" was taken for "rta", as two letters in the wrong order counted as two mistakes.
TEST(Suggest, CountsSwappedLettersOnce) {
  const std::vector<std::string> valid{"rta", "run"};
  EXPECT_EQ(suggest("rnu", valid), "did you mean 'run'? valid: rta, run");
}

TEST(Suggest, DoesNotGuessWhenNothingIsClose) {
  EXPECT_EQ(suggest("rate_monotonic", kSchedulers), "valid: chain_priority, fifo, ros");
}

TEST(Suggest, CountsCapitalsAsSmallLetters) {
  EXPECT_EQ(suggest("FIFO", kSchedulers), "did you mean 'fifo'? valid: chain_priority, fifo, ros");
}

// "prio" was taken for "period", which is two letters away.
TEST(Suggest, TakesABeginningForTheOnlyWordThatBeginsSo) {
  const std::vector<std::string> valid{"period", "priority"};
  EXPECT_EQ(suggest("prio", valid), "did you mean 'priority'? valid: period, priority");
  EXPECT_EQ(suggest("p", valid), "valid: period, priority");
}

// Two names of a megabyte in a configuration file took hours to compare.
TEST(Suggest, DoesNotCompareWordsThatNobodyTypes) {
  const std::vector<std::string> valid{std::string(1 << 20, 'x')};
  EXPECT_EQ(suggest(std::string(1 << 20, 'y'), valid), "valid: " + valid[0]);
}

// All 300 message types stood in one line.
TEST(Suggest, ShowsOfManyWordsTheNearestOnes) {
  std::vector<std::string> valid;
  for (int i = 100; i < 200; ++i) valid.push_back("number_" + std::to_string(i));
  valid.push_back("twist");
  valid.push_back(std::string(1 << 20, 'x'));
  const std::string advice = suggest("twits", valid);
  EXPECT_TRUE(advice.starts_with("did you mean 'twist'? valid: number_1")) << advice;
  EXPECT_TRUE(advice.ends_with(", twist, and 72 more")) << advice;
  EXPECT_EQ(suggest(std::string(1 << 20, 'y'), valid).find("number_130"), std::string::npos);
}

TEST(Suggest, BearsEmptyListsAndWords) {
  EXPECT_EQ(suggest("fifo", {}), "there are none");
  EXPECT_EQ(suggest("", kSchedulers), "valid: chain_priority, fifo, ros");
}

TEST(ErrnoMessage, IsTheSystemsText) {
  EXPECT_EQ(errno_message(EPERM), "Operation not permitted");
}

}  // namespace
}  // namespace takt
