// Tests that a user's function is neither called nor destroyed under one of Takt's locks.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/user_function.hpp"

#include <memory>
#include <mutex>
#include <utility>

#include <gtest/gtest.h>

#include "takt/base/pi_mutex.hpp"

namespace takt::detail {
namespace {

using Function = UserFunction<int(int)>;

TEST(UserFunction, CallsWhatItOwnsAndLetsGoOfIt) {
  const auto owned = std::make_shared<int>(3);
  Function function([owned](int number) { return *owned + number; });
  EXPECT_EQ(function(4), 7);
  Function other;
  EXPECT_FALSE(other);
  other = std::move(function);
  EXPECT_FALSE(function);  // NOLINT(bugprone-use-after-move): it is empty then
  EXPECT_EQ(other(1), 4);
  other = {};
  EXPECT_EQ(owned.use_count(), 1);
}

TEST(UserFunction, CanBeMovedUnderALock) {
  PiMutex mutex;
  Function function([](int number) { return number; });
  Function taken;
  {
    const std::lock_guard lock(mutex);
    taken = std::move(function);
  }
  EXPECT_EQ(taken(5), 5);
}

#ifdef TAKT_CHECK_LOCKS
TEST(UserFunctionDeathTest, IsNeitherCalledNorDestroyedUnderALock) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto under_a_lock = [](auto&& use) {
    PiMutex mutex;
    Function function([](int number) { return number; });
    const std::lock_guard lock(mutex);
    use(function);
  };
  EXPECT_DEATH(under_a_lock([](Function& function) { function(1); }), "under a lock of Takt");
  EXPECT_DEATH(under_a_lock([](Function& function) { function = {}; }), "under a lock of Takt");
}
#endif

}  // namespace
}  // namespace takt::detail
