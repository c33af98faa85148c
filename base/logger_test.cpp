// Tests of the logger.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/logger.hpp"

#include <array>
#include <latch>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

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
  std::latch go_on(1), told(1);
  std::uint64_t lines = 0;
  logger_.set_writer([&](LogLevel level, std::string_view text) {
    go_on.wait();
    if (level == LogLevel::error) ++lines;
    if (text == "44 log lines were dropped: more than 256 at once") told.count_down();
  });
  for (std::uint64_t i = 0; i < Logger::kRecords + kTooMany; ++i) {
    log(LogLevel::error, "line {}", i);
  }
  EXPECT_EQ(logger_.dropped() - dropped_before, kTooMany);
  go_on.count_down();
  told.wait();
  logger_.flush();
  EXPECT_EQ(lines, Logger::kRecords);
}

TEST_F(LoggerTest, TakesLinesFromManyThreadsAndKeepsTheOrderOfEach) {
  constexpr int kThreads = 4;
  constexpr int kLines = 50;  // all together fit into the pool
  std::latch start(kThreads);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      start.arrive_and_wait();
      for (int i = 0; i < kLines; ++i) log(LogLevel::info, "{} {}", thread, i);
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::vector<std::vector<std::string>> of_thread(kThreads);
  for (const Line& line : written_lines()) {
    of_thread.at(static_cast<std::size_t>(line.text[0] - '0')).push_back(line.text);
  }
  for (int thread = 0; thread < kThreads; ++thread) {
    std::vector<std::string> expected;
    for (int i = 0; i < kLines; ++i) expected.push_back(fmt::format("{} {}", thread, i));
    EXPECT_EQ(of_thread[static_cast<std::size_t>(thread)], expected);
  }
}

}  // namespace
}  // namespace takt
