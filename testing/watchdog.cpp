// Ends a test program that hangs, before ctest does: it says which test, and where its threads are.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/testing/stacks.hpp"

// Every program of takt_test() links it. A timer, not a thread: tests count threads, and fork.
namespace takt {
namespace {

std::array<char, 500> report{"\nhangs before its first test\n"};

void on_limit(int /*signal*/) {
  std::size_t size = 0;
  while (report.at(size) != '\0') ++size;
  [[maybe_unused]] const ssize_t said = write(STDERR_FILENO, report.data(), size);
  stacks::print();
  std::abort();
}

class NameOfTest : public testing::EmptyTestEventListener {
  void OnTestStart(const testing::TestInfo& test) override {
    std::snprintf(report.data(), report.size(), "\nhangs in %s.%s\n", test.test_suite_name(),
                  test.name());
  }
  void OnTestEnd(const testing::TestInfo& test) override {
    std::snprintf(report.data(), report.size(), "\nhangs after %s.%s\n", test.test_suite_name(),
                  test.name());
  }
};

/// TAKT_TEST_SECONDS: how long the program may take. Without it, as long as it likes.
[[maybe_unused]] const bool is_armed = [] {
  const char* const limit = std::getenv("TAKT_TEST_SECONDS");
  if (limit == nullptr) return false;
  stacks::prepare();
  testing::UnitTest::GetInstance()->listeners().Append(new NameOfTest);
  sigevent event{};
  event.sigev_notify = SIGEV_SIGNAL;
  event.sigev_signo = SIGRTMIN + 6;
  std::signal(event.sigev_signo, on_limit);
  timer_t timer{};
  const itimerspec time{{}, {std::atol(limit), 0}};
  return timer_create(CLOCK_MONOTONIC, &event, &timer) == 0 &&
         timer_settime(timer, 0, &time, nullptr) == 0;
}();

}  // namespace
}  // namespace takt
