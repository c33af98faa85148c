// A field that is forgotten, or described twice, is found while compiling.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/fields.hpp"

#include <cstdint>
#include <string>

#include <gtest/gtest.h>

namespace takt {

struct FieldsPart {
  std::uint64_t misses = 0;
  std::optional<std::uint64_t> late;
};
struct FieldsRow : FieldsPart {
  std::string name;
  std::vector<int> notes;
  double percent() const { return static_cast<double>(misses) / 2; }
};
template <>
inline constexpr auto kFields<FieldsPart> =
    std::tuple{sum("misses", &FieldsPart::misses, ""), sum("late", &FieldsPart::late, "")};
template <>
inline constexpr auto kFields<FieldsRow> =
    std::tuple{BasePart<FieldsPart>{}, keep("name", &FieldsRow::name, ""),
               sum("notes", &FieldsRow::notes, ""), computed("percent", &FieldsRow::percent, "")};

static_assert(describe_all<FieldsRow>(kFields<FieldsRow>));
static_assert(!describe_all<FieldsPart>(std::tuple{sum("misses", &FieldsPart::misses, "")}));
static_assert(!describe_all<FieldsPart>(std::tuple{sum("misses", &FieldsPart::misses, ""),
                                                   sum("late", &FieldsPart::misses, "")}));
static_assert(!describe_all<FieldsRow>(std::tuple{keep("name", &FieldsRow::name, ""),
                                                  sum("notes", &FieldsRow::notes, ""),
                                                  computed("percent", &FieldsRow::percent, "")}));

TEST(Fields, OfTwoRowsBecomeOneAsEachSays) {
  FieldsRow row{{1, std::nullopt}, "first", {1}};
  merge(row, FieldsRow{{2, 5}, "second", {2, 3}});
  merge(row, FieldsRow{{3, std::nullopt}, "third", {}});
  EXPECT_EQ(row.misses, 6u);
  EXPECT_EQ(row.late, 5u);
  EXPECT_EQ(row.name, "first");
  EXPECT_EQ(row.notes, (std::vector{1, 2, 3}));
}

TEST(Fields, AreVisitedInTheirOrderWithThoseThatAreComputed) {
  std::string names;
  const FieldsRow row{{3, 1}, "row", {}};
  for_each_field(
      [&](const auto& field, const auto& /*value*/) { names += field.name + std::string(" "); },
      row);
  EXPECT_EQ(names, "misses late name notes percent ");
}

}  // namespace takt
