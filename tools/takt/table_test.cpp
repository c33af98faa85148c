// Tests of tables.
// SPDX-License-Identifier: Apache-2.0
#include "table.hpp"

#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using namespace std::chrono_literals;

std::string printed(const Table& table) {
  testing::internal::CaptureStdout();
  table.print("title");
  return testing::internal::GetCapturedStdout();
}

TEST(Table, SetsWordsLeftAndNumbersRight) {
  Table table({"name", "count", "p99"});
  table.add({"a", "7", "12.3"});
  table.add({"longer", "1042", "-"});
  EXPECT_EQ(printed(table),
            "\n"
            "title\n"
            "name    count   p99\n"
            "a           7  12.3\n"
            "longer   1042     -\n");
}

TEST(Table, SetsAColumnLeftInWhichOneCellIsAWord) {
  Table table({"count", "note"});
  table.add({"7", "12"});
  table.add({"none", ""});
  EXPECT_EQ(printed(table),
            "\n"
            "title\n"
            "count  note\n"
            "7        12\n"
            "none\n");
}

TEST(Table, WithoutRowsIsNotPrinted) {
  EXPECT_EQ(printed(Table({"name"})), "");
}

TEST(Table, GivesMicrosecondsAsManyDigitsAsMatter) {
  EXPECT_EQ(microseconds(846ns), "0.85");
  EXPECT_EQ(microseconds(12'340ns), "12.3");
  EXPECT_EQ(microseconds(1'042'400ns), "1042");
}

}  // namespace
}  // namespace takt::tools
