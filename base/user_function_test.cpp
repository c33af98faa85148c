// Tests that a user's function is neither called nor destroyed under one of Takt's locks.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/user_function.hpp"

#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include <gtest/gtest.h>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/realtime_scope.hpp"

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

TEST(UserFunction, HoldsWhatCannotBeCopied) {
  Function function([owned = std::make_unique<int>(3)](int number) { return *owned + number; });
  const Function taken = std::move(function);
  EXPECT_EQ(taken(4), 7);
}

TEST(UserFunction, AllocatesOnlyForWhatIsLargerThanAFunction) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto owned = std::make_shared<int>(3);
  const std::array<int, 20> large{1, 2};
  const RealtimeScope scope;
  const Function small([owned, other = owned](int number) { return *owned + *other + number; });
  EXPECT_EQ(scope.so_far().allocations, 0u);
  Function far([large](int number) { return large[1] + number; });
  EXPECT_EQ(scope.so_far().allocations, 1u);
  const Function moved = std::move(far);
  EXPECT_EQ(scope.so_far().allocations, 1u);
  EXPECT_EQ(small(1), 7);
  EXPECT_EQ(moved(1), 3);
}

TEST(UserFunction, OfAnEmptyFunctionIsEmpty) {
  EXPECT_FALSE(Function(nullptr));
  EXPECT_FALSE(Function(std::function<int(int)>()));
  EXPECT_FALSE(Function(std::function<int(long)>()));
  EXPECT_FALSE(Function(static_cast<int (*)(int)>(nullptr)));
  EXPECT_THROW(Function()(1), std::bad_function_call);
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
