// Tests of the memory for what the standard library allocates.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/cells.hpp"

#include <array>
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

TEST(Cells, HoldSharedObjectsAndPromisesWithoutTheHeap) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const Cells cells(3, 128);
  const RealtimeScope scope;
  for (int round = 0; round < 10; ++round) {
    const auto number = std::allocate_shared<int>(cells.allocator(), round);
    std::promise<int> promise(std::allocator_arg, cells.allocator());
    std::future<int> future = promise.get_future();
    promise.set_value(*number);
    EXPECT_EQ(future.get(), round);
  }
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

TEST(Cells, TakeFromTheHeapWhatIsLargerOrBeyondThem) {
  const Cells cells(2, 32);
  std::vector<std::shared_ptr<int>> numbers;
  for (int i = 0; i < 5; ++i) {
    numbers.push_back(std::allocate_shared<int>(cells.allocator(), i));
  }
  const auto large = std::allocate_shared<std::array<int, 100>>(cells.allocator());
  large->fill(7);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(*numbers[static_cast<std::size_t>(i)], i);
  numbers.clear();
  EXPECT_EQ(large->back(), 7);
}

TEST(Cells, AreKeptByWhatLiesInThem) {
  auto cells = std::make_optional<Cells>(1, 64);
  auto number = std::allocate_shared<int>(cells->allocator(), 4);
  std::weak_ptr<int> weak = number;
  cells.reset();
  EXPECT_EQ(*number, 4);
  number.reset();
  EXPECT_TRUE(weak.expired());
}

}  // namespace
}  // namespace takt
