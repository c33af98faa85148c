// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/entries.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/message_type.hpp"

namespace takt {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

struct Row {
  std::vector<std::string> names;
  std::vector<double> numbers;
};
struct Table {
  std::vector<Row> rows;
};
TAKT_MESSAGE(Row, "test/msg/Row", names, numbers);
TAKT_MESSAGE(Table, "test/msg/Table", rows);

TEST(Entries, OfTheLongestListCountAtAnyLevel) {
  Table table;
  table.rows.resize(kMostEntries);
  EXPECT_THAT(why_too_long(table), IsEmpty());
  table.rows.resize(kMostEntries + 1);
  EXPECT_THAT(why_too_long(table),
              HasSubstr("a list of 10001 entries is refused; send 10000 at most"));
  table.rows.resize(1);
  table.rows[0].names.resize(kMostEntries + 1);
  EXPECT_THAT(why_too_long(table), HasSubstr("10001"));
}

TEST(Entries, MayBeAnyNumberOfNumbers) {
  Table table;
  table.rows.resize(1);
  table.rows[0].numbers.resize(10 * kMostEntries);
  EXPECT_THAT(why_too_long(table), IsEmpty());
}

}  // namespace
}  // namespace takt
