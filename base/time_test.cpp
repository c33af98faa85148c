// Tests of durations as people write them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/time.hpp"

#include <string>

#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

std::string error_of(std::string_view text) {
  try {
    parse_duration(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

constexpr const char* kAdvice = "; write a number and one of ns, us, ms, s, m, h, such as 20ms";

TEST(Duration, IsANumberAndAUnit) {
  EXPECT_EQ(parse_duration("500ns"), 500ns);
  EXPECT_EQ(parse_duration("800us"), 800us);
  EXPECT_EQ(parse_duration("20ms"), 20ms);
  EXPECT_EQ(parse_duration("10s"), 10s);
  EXPECT_EQ(parse_duration("2m"), 2min);
  EXPECT_EQ(parse_duration("1h"), 1h);
  EXPECT_EQ(parse_duration("0s"), 0s);
}

TEST(Duration, MayHaveAFraction) {
  EXPECT_EQ(parse_duration("1.5s"), 1500ms);
  EXPECT_EQ(parse_duration("0.1us"), 100ns);
  EXPECT_EQ(parse_duration("2.5h"), 150min);
}

TEST(Duration, WithoutAUnitIsAnErrorThatListsTheUnits) {
  EXPECT_EQ(error_of("800"), std::string("'800' has no unit") + kAdvice);
  EXPECT_EQ(error_of("1.5"), std::string("'1.5' has no unit") + kAdvice);
}

TEST(Duration, WithAnUnknownUnitIsAnErrorThatListsTheUnits) {
  EXPECT_EQ(error_of("2days"), std::string("'2days' has the unknown unit 'days'") + kAdvice);
  EXPECT_EQ(error_of("5 ms"), std::string("'5 ms' has the unknown unit ' ms'") + kAdvice);
  EXPECT_EQ(error_of("5MS"), std::string("'5MS' has the unknown unit 'MS'") + kAdvice);
}

TEST(Duration, IsNothingElse) {
  for (const std::string text : {"", "ms", "-5ms", "+5ms", "infs", "nans", "soon", " 5ms"}) {
    EXPECT_EQ(error_of(text), "'" + text + "' is not a duration" + kAdvice);
  }
}

// Nine digits of ns stood beside milliseconds.
TEST(Duration, IsWrittenForPeopleAndExactly) {
  for (const std::string text : {"0s", "7ns", "1024ns", "9999ns", "12.345us", "9800us", "20ms",
                                 "9.799999ms", "1.000000001s", "-5ns"}) {
    const bool is_negative = text[0] == '-';
    const Nanoseconds time = parse_duration(text.substr(is_negative ? 1 : 0));
    EXPECT_EQ(to_string(is_negative ? -time : time), text);
  }
}

TEST(Duration, OfARunIsNotZero) {
  EXPECT_EQ(parse_run_time("1s"), 1s);
  EXPECT_THROW(parse_run_time("1"), Error);
  EXPECT_THROW(parse_run_time("0s"), Error);
}

TEST(Duration, IsNotLongerThanTheClockCounts) {
  EXPECT_EQ(parse_duration("2500000h"), std::chrono::hours(2500000));
  EXPECT_EQ(error_of("2600000h"),
            std::string("'2600000h' is longer than 292 years, the maximum") + kAdvice);
}

// A sum that overflowed was a time long ago: what was to last for ever was over at once.
TEST(Later, IsAtMostNeverAndAtLeastTheFirstTime) {
  const TimePoint now(1h);
  EXPECT_EQ(later(now, 1s), TimePoint(3601s));
  EXPECT_EQ(later(now, -1s), TimePoint(3599s));
  EXPECT_EQ(later(now, Nanoseconds::max()), kNever);
  EXPECT_EQ(later(kNever, 1ns), kNever);
  EXPECT_EQ(later(TimePoint(-1h), Nanoseconds::min()), TimePoint::min());
  EXPECT_EQ(later(TimePoint{}, Nanoseconds::min()), TimePoint::min());
  EXPECT_EQ(later(TimePoint::min(), Nanoseconds::max()), TimePoint(-1ns));
}

TEST(Between, IsAtMostTheLongestDuration) {
  EXPECT_EQ(between(TimePoint(1s), TimePoint(3s)), 2s);
  EXPECT_EQ(between(TimePoint(3s), TimePoint(1s)), -2s);
  EXPECT_EQ(between(TimePoint::min(), TimePoint(1s)), Nanoseconds::max());
  EXPECT_EQ(between(TimePoint(1s), TimePoint::min()), Nanoseconds::min());
  EXPECT_EQ(between(kNever, TimePoint::min()), Nanoseconds::min());
}

}  // namespace
}  // namespace takt
