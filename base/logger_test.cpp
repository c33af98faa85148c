// Tests of the logger.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/logger.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <latch>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include "takt/base/error.hpp"
#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

using testing::ElementsAre;

// The logger is one for the process: each test gives it a writer of its own and takes it away.
class LoggerTest : public testing::Test {
 protected:
  LoggerTest() {
    logger_.set_writer([this](LogLevel level, std::string_view text) {
      const std::lock_guard lock(mutex_);
      lines_.push_back({level, std::string(text)});
      if (level == LogLevel::warn && text.ends_with(" at once")) {
        reported_dropped_.fetch_add(std::stoull(lines_.back().text));
        reported_dropped_.notify_all();
      }
    });
  }
  ~LoggerTest() override {
    logger_.flush();
    logger_.set_level(LogLevel::info);
    logger_.set_writer({});
  }

  struct Line {
    LogLevel level;
    std::string text;
    bool operator==(const Line&) const = default;
  };
  std::vector<Line> written_lines() {
    logger_.flush();
    const std::lock_guard lock(mutex_);
    return lines_;
  }

  Logger& logger_ = Logger::instance();
  std::mutex mutex_;
  std::vector<Line> lines_;
  std::atomic<std::uint64_t> reported_dropped_{0};
};

TEST_F(LoggerTest, WritesFormattedLinesInOrderWithTheirLevels) {
  log(LogLevel::info, "scan {} of {}", 1, "lidar");
  log(LogLevel::warn, "late");
  log(LogLevel::error, "lost");
  EXPECT_THAT(written_lines(),
              ElementsAre(Line{LogLevel::info, "scan 1 of lidar"}, Line{LogLevel::warn, "late"},
                          Line{LogLevel::error, "lost"}));
}

TEST_F(LoggerTest, LeavesOutWhatIsBelowItsLevel) {
  log(LogLevel::debug, "hidden at first");
  logger_.set_level(LogLevel::debug);
  log(LogLevel::debug, "shown");
  logger_.set_level(LogLevel::error);
  log(LogLevel::warn, "hidden again");
  EXPECT_THAT(written_lines(), ElementsAre(Line{LogLevel::debug, "shown"}));
}

TEST_F(LoggerTest, CutsALineThatIsTooLong) {
  log(LogLevel::info, "{}", std::string(Logger::kLineBytes, 'a'));
  log(LogLevel::info, "{}", std::string(Logger::kLineBytes, 'b') + "c");
  EXPECT_THAT(written_lines(),
              ElementsAre(Line{LogLevel::info, std::string(Logger::kLineBytes, 'a')},
                          Line{LogLevel::info, std::string(Logger::kLineBytes, 'b')}));
}

TEST_F(LoggerTest, WritesInAThreadOfItsOwnWithAName) {
  std::array<char, 16> name{};
  std::thread::id writing_thread;
  logger_.flush();
  logger_.set_writer([&](LogLevel, std::string_view) {
    pthread_getname_np(pthread_self(), name.data(), name.size());
    writing_thread = std::this_thread::get_id();
  });
  log(LogLevel::info, "who writes?");
  logger_.flush();
  EXPECT_STREQ(name.data(), "log");
  EXPECT_NE(writing_thread, std::this_thread::get_id());
}

TEST_F(LoggerTest, LogsWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  log(LogLevel::info, "the first line starts the thread");
  logger_.flush();
  const RealtimeScope scope;
  log(LogLevel::info, "number {} and {}", 5, 2.5);
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

// The writer holds its record while it writes, so with it blocked exactly kRecords are accepted.
TEST_F(LoggerTest, DropsAndCountsWhatDoesNotFitAndSaysSoLater) {
  constexpr std::uint64_t kTooMany = 44;
  const std::uint64_t dropped_before = logger_.dropped();
  std::latch go_on(1), reported(1);
  std::uint64_t lines = 0;
  logger_.set_writer([&](LogLevel level, std::string_view text) {
    go_on.wait();
    if (level == LogLevel::error) ++lines;
    if (text == "44 log lines were dropped: more than 256 at once") reported.count_down();
  });
  for (std::uint64_t i = 0; i < Logger::kRecords + kTooMany; ++i) {
    log(LogLevel::error, "line {}", i);
  }
  EXPECT_EQ(logger_.dropped() - dropped_before, kTooMany);
  go_on.count_down();
  reported.wait();
  logger_.flush();
  EXPECT_EQ(lines, Logger::kRecords);
}

TEST_F(LoggerTest, RunsAFunctionInItsThreadBeforeItReturns) {
  for (int round = 0; round < 3; ++round) {
    std::thread::id ran_in;
    logger_.run_in_thread([&] { ran_in = std::this_thread::get_id(); });
    EXPECT_NE(ran_in, std::thread::id());
    EXPECT_NE(ran_in, std::this_thread::get_id());
  }
}

TEST_F(LoggerTest, PassesOnWhatAFunctionInItsThreadThrows) {
  EXPECT_THROW(logger_.run_in_thread([] { throw Error("refused"); }), Error);
  bool ran = false;
  logger_.run_in_thread([&] { ran = true; });
  EXPECT_TRUE(ran);
}

TEST_F(LoggerTest, WritesOrCountsEachLineOfManyThreadsAndKeepsTheOrderOfEach) {
  constexpr int kThreads = 4;
  constexpr int kLines = 50;
  const std::uint64_t dropped_before = logger_.dropped();
  std::latch start(kThreads);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      start.arrive_and_wait();
      for (int i = 0; i < kLines; ++i) log(LogLevel::error, "{} {}", thread, i);
    });
  }
  for (std::thread& thread : threads) thread.join();
  const std::uint64_t dropped = logger_.dropped() - dropped_before;
  // The notice about dropped lines is no line of ours: flush does not wait for it.
  for (std::uint64_t reported; (reported = reported_dropped_) < dropped;)
    reported_dropped_.wait(reported);
  std::vector<int> last(kThreads, -1);
  std::uint64_t written = 0;
  for (const Line& line : written_lines()) {
    if (line.level != LogLevel::error) continue;
    int& last_of_thread = last.at(static_cast<std::size_t>(line.text[0] - '0'));
    const int number = std::stoi(line.text.substr(2));
    EXPECT_GT(number, last_of_thread) << line.text;
    last_of_thread = number;
    ++written;
  }
  EXPECT_EQ(written + dropped, std::uint64_t{kThreads * kLines});
}

// A peer that made endpoints of wrong types filled the log with 1,100 lines a second.
TEST(LogThrottle, LetsSomeLinesOfASecondPassAndCountsTheRest) {
  LogThrottle one, three(3);
  int ones = 0, threes = 0;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 1000; ++i) {
    ones += one.may_log() ? 1 : 0;
    threes += three.may_log() ? 1 : 0;
  }
  const auto seconds =
      static_cast<int>((std::chrono::steady_clock::now() - begin) / std::chrono::seconds(1)) + 1;
  EXPECT_GE(ones, 1);
  EXPECT_LE(ones, seconds);
  EXPECT_GE(threes, 3);
  EXPECT_LE(threes, 3 * seconds);
}

// A line of another process's text looked like lines of ours.
TEST(Logger, WritesALineAsOne) {
  std::string written;
  Logger::instance().set_writer([&](LogLevel, std::string_view line) { written += line; });
  log(LogLevel::warn, "node '{}'", "a\n[error] b\x1b[31m\xff");
  Logger::instance().flush();
  Logger::instance().set_writer({});
  EXPECT_EQ(written, "node 'a\\n[error] b\\u001b[31m\\xff'");
}

// A destructor of an object with static storage that logged used a destroyed logger: the line was
// lost.
TEST(LoggerDeathTest, WhatIsDestroyedAfterMainCanLog) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        std::atexit([] { log(LogLevel::info, "at the end"); });  // runs after the logger's end
        log(LogLevel::info, "before");
        std::exit(0);
      },
      testing::ExitedWithCode(0), "before\n.*at the end");
}

}  // namespace
}  // namespace takt
