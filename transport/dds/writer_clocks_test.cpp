// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/writer_clocks.hpp"

#include <gtest/gtest.h>

namespace takt {
namespace {

using namespace std::chrono_literals;

/// Two clocks of one time, which goes on with every reading: by 30 ns, or as long as the thread is
/// preempted there.
class Clocks {
 public:
  explicit Clocks(std::vector<Nanoseconds> pauses) : pauses_(std::move(pauses)) {}
  ClockPair read() {
    return read_together([this] { return TimePoint(pass()); }, [this] { return kOffset + pass(); });
  }
  /// By how much the wall clock of the pair was read later.
  static Nanoseconds apart(const ClockPair& pair) {
    return pair.wall - kOffset - pair.steady.time_since_epoch();
  }
  std::size_t readings() const { return readings_; }

 private:
  static constexpr Nanoseconds kOffset = 1000h;
  Nanoseconds pass() {
    now_ += readings_ < pauses_.size() ? pauses_[readings_] : 30ns;
    ++readings_;
    return now_;
  }
  const std::vector<Nanoseconds> pauses_;
  std::size_t readings_ = 0;
  Nanoseconds now_ = 1s;
};

TEST(WriterClocks, ReadBothClocksOnceWhereNothingComesBetween) {
  Clocks clocks({});
  EXPECT_EQ(Clocks::apart(clocks.read()), 30ns);
  EXPECT_EQ(clocks.readings(), 3u);
}

// A thread that was preempted between its two readings made the message so much older.
TEST(WriterClocks, AreReadAgainWhereTheThreadWasPreemptedBetween) {
  Clocks clocks({30ns, 34us});
  EXPECT_EQ(Clocks::apart(clocks.read()), 30ns);
}

TEST(WriterClocks, TakeTheClosestOfFewReadings) {
  Clocks clocks({0ns, 9us, 1us, 0ns, 2us, 1us, 0ns, 7us, 1us, 0ns, 8us, 1us});
  EXPECT_EQ(Clocks::apart(clocks.read()), 2us);
  EXPECT_EQ(clocks.readings(), 12u);
}

}  // namespace
}  // namespace takt
