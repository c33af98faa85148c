// A test program that hangs, for watchdog_test.py.
// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

namespace {

void waits_for_ever() {
  for (;;) pause();
}

TEST(Hanging, IsOver) {
}

TEST(Hanging, JoinsAThreadThatDoesNotEnd) {
  std::thread other(waits_for_ever);
  other.join();
}

}  // namespace
