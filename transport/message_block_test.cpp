// Tests of messages in transit: what holds them, and where they go afterwards.
// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/message_block.hpp"

#include <atomic>
#include <latch>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/realtime_scope.hpp"

namespace takt {
namespace {

struct Scan {
  Scan() { alive.fetch_add(1); }
  Scan(const Scan& other) : ranges(other.ranges) { alive.fetch_add(1); }
  ~Scan() { alive.fetch_sub(1); }

  std::vector<int> ranges;
  static inline std::atomic<int> alive{0};
};

using Loaned = LoanedBlock;
using Owned = OwnedBlock;

class MessageBlockTest : public testing::Test {
 protected:
  void SetUp() override { alive_before_ = Scan::alive; }
  int alive() const { return Scan::alive - alive_before_; }

  Scan prototype_;
  PoolPtr<Loaned> loans_ = make_loans(1, kMakerOf<Scan>, &prototype_);
  PoolPtr<Owned> wrappers_{Pool<Owned>::create(1)};

 private:
  int alive_before_ = 0;
};

TEST_F(MessageBlockTest, LoanedGoesHomeWithTheLastRelease) {
  Loaned* block = loans_->acquire();
  block->set_references(2);
  EXPECT_EQ(block->payload(), block->message());
  block->release();
  EXPECT_EQ(loans_->acquire(), nullptr);
  block->release();
  EXPECT_EQ(loans_->acquire(), block);
  Pool<Loaned>::recycle(*block);
}

TEST_F(MessageBlockTest, LoanedKeepsItsMemoryFromOneLoanToTheNext) {
  Loaned* block = loans_->acquire();
  static_cast<Scan*>(block->message())->ranges.reserve(100);
  const int* memory = static_cast<Scan*>(block->message())->ranges.data();
  block->set_references(1);
  block->release();
  block = loans_->acquire();
  EXPECT_EQ(static_cast<Scan*>(block->message())->ranges.data(), memory);
  Pool<Loaned>::recycle(*block);
}

TEST_F(MessageBlockTest, LoanedIsNeverGivenAwayOrShared) {
  Loaned* block = loans_->acquire();
  block->set_references(1);
  EXPECT_EQ(block->steal(), nullptr);
  EXPECT_EQ(block->shared(), nullptr);
  block->release();
}

TEST_F(MessageBlockTest, OwnedFreesAUniqueMessageWithTheLastRelease) {
  Owned* block = wrappers_->acquire();
  auto message = std::make_unique<Scan>();
  const Scan* address = message.get();
  block->own(std::move(message));
  EXPECT_EQ(block->payload(), address);
  EXPECT_EQ(block->shared(), nullptr);
  block->set_references(2);
  block->release();
  EXPECT_EQ(alive(), 1);
  block->release();
  EXPECT_EQ(alive(), 0);
  EXPECT_EQ(wrappers_->acquire(), block);
  Pool<Owned>::recycle(*block);
}

TEST_F(MessageBlockTest, OwnedGivesAUniqueMessageAwayToTheLastHolderOnly) {
  Owned* block = wrappers_->acquire();
  auto message = std::make_unique<Scan>();
  Scan* address = message.get();
  block->own(std::move(message));
  block->set_references(2);
  EXPECT_EQ(block->steal(), nullptr);
  block->release();
  const std::unique_ptr<Scan> stolen(static_cast<Scan*>(block->steal()));
  EXPECT_EQ(stolen.get(), address);
  block->release();
  EXPECT_EQ(alive(), 1);
}

TEST_F(MessageBlockTest, OwnedDropsItsShareOfASharedMessageWithTheLastRelease) {
  Owned* block = wrappers_->acquire();
  const auto message = std::make_shared<const Scan>();
  block->own(message);
  block->set_references(1);
  EXPECT_EQ(block->payload(), message.get());
  ASSERT_NE(block->shared(), nullptr);
  EXPECT_EQ(block->shared()->get(), message.get());
  EXPECT_EQ(block->steal(), nullptr);
  EXPECT_EQ(message.use_count(), 2);
  block->release();
  EXPECT_EQ(message.use_count(), 1);
}

TEST_F(MessageBlockTest, OwnedRemembersNothingOfItsLastMessage) {
  Owned* block = wrappers_->acquire();
  block->own(std::make_shared<const Scan>());
  block->set_references(1);
  block->release();
  block = wrappers_->acquire();
  block->own(std::make_unique<Scan>());
  block->set_references(1);
  EXPECT_EQ(block->shared(), nullptr);
  block->release();
  EXPECT_EQ(alive(), 0);
}

// Freed twice or never would be seen by the address sanitizer.
TEST_F(MessageBlockTest, OwnedFromTheHeapFreesItself) {
  auto* block = new Owned;
  block->from_heap = true;
  block->own(std::make_unique<Scan>());
  block->set_references(1);
  block->release();
  EXPECT_EQ(alive(), 0);
}

TEST_F(MessageBlockTest, LoanedIsReleasedWithoutAllocating) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  Loaned* block = loans_->acquire();
  block->set_references(2);
  const RealtimeScope scope;
  block->release();
  block->release();
  EXPECT_EQ(scope.so_far().allocations, 0u);
}

TEST_F(MessageBlockTest, GoesHomeExactlyOnceWhenAllReleaseItAtOnce) {
  constexpr std::uint32_t kHolders = 3;
  for (int round = 0; round < 200; ++round) {
    Loaned* block = loans_->acquire();
    ASSERT_NE(block, nullptr) << "round " << round;
    ASSERT_EQ(loans_->acquire(), nullptr) << "round " << round;
    static_cast<Scan*>(block->message())->ranges.assign(1, round);
    block->set_references(kHolders);
    std::latch start(kHolders);
    std::vector<std::thread> holders;
    for (std::uint32_t i = 0; i < kHolders; ++i) {
      holders.emplace_back([&] {
        start.arrive_and_wait();
        EXPECT_EQ(static_cast<const Scan*>(block->payload())->ranges[0], round);
        block->release();
      });
    }
    for (std::thread& holder : holders) holder.join();
  }
}

}  // namespace
}  // namespace takt
