// How a test waits for what another thread or process does.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_EVENTUALLY_HPP_
#define TAKT_TESTING_EVENTUALLY_HPP_

#include <algorithm>
#include <chrono>
#include <thread>

namespace takt {

/// Waits, in real time, until the condition holds; false after a minute. EXPECT_TRUE and
/// ASSERT_TRUE then print the condition. Choose one that stays true: a busy machine misses a
/// moment.
template <class Condition>
[[nodiscard]] bool eventually(Condition&& condition) {
  using namespace std::chrono_literals;
  const auto begin = std::chrono::steady_clock::now();
  while (!condition()) {
    const auto waited = std::chrono::steady_clock::now() - begin;
    if (waited > 1min) return false;
    if (waited < 100us) {  // mostly another thread has only a few steps to go
      std::this_thread::yield();
    } else {
      std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(waited / 2, 1ms));
    }
  }
  return true;
}

}  // namespace takt

#endif  // TAKT_TESTING_EVENTUALLY_HPP_
