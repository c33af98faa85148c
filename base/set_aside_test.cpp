// SPDX-License-Identifier: Apache-2.0
#include "takt/base/set_aside.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/base/lockfree/pool.hpp"

namespace takt {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__)
constexpr bool kIsCounted = false;  // sanitizers have memory of their own
#else
constexpr bool kIsCounted = true;
#endif

std::size_t resident_bytes() {
  std::size_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

TEST(SetAside, MemoryIsThereAndAligned) {
  struct Piece {
    std::byte* memory;
    std::size_t bytes, alignment;
  };
  std::vector<Piece> pieces;
  for (const std::size_t alignment : {1, 8, 16, 64, 256, 4096}) {
    for (const std::size_t bytes : {0, 1, 40, 80, 100, 2704, 5000, 18'000, 70'000, 300'000}) {
      for (int i = 0; i < 3; ++i) {
        void* const memory = set_aside(bytes, alignment);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % alignment, 0u) << bytes;
        pieces.push_back({static_cast<std::byte*>(memory), bytes, alignment});
      }
    }
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    std::memset(pieces[i].memory, static_cast<int>(i), pieces[i].bytes);
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (const std::size_t at : {std::size_t{0}, pieces[i].bytes / 2, pieces[i].bytes - 1}) {
      if (pieces[i].bytes == 0) continue;
      EXPECT_EQ(pieces[i].memory[at], static_cast<std::byte>(i));
    }
    give_back(pieces[i].memory, pieces[i].bytes, pieces[i].alignment);
  }
}

// Each callback took 18 kB for times, and each publisher 200 bytes for each message of its depth.
TEST(SetAside, WhatIsNotUsedTakesNoMemory) {
  if (!kIsCounted) GTEST_SKIP();
  struct Message : PoolNode<Message> {
    std::byte bytes[180];
  };
  struct Times {
    std::byte bytes[18'000] = {};
  };
  constexpr std::size_t kMessages = 1000, kMany = 200;
  const std::size_t before = resident_bytes();
  std::vector<PoolPtr<Message>> pools;
  std::vector<std::unique_ptr<SetAside<Times>>> times;
  for (std::size_t i = 0; i < kMany; ++i) {
    pools.emplace_back(Pool<Message>::create(kMessages));
    pools.emplace_back(Pool<Message>::create(26));
    times.push_back(std::make_unique<SetAside<Times>>());
  }
  constexpr std::size_t kAll = kMany * (1026 * sizeof(Message) + sizeof(Times));
  EXPECT_LT(resident_bytes(), before + kAll / 20);
  for (std::size_t i = 0; i < kMany; ++i) {
    Message* const message = pools[2 * i]->acquire();
    ASSERT_NE(message, nullptr);
    Pool<Message>::recycle(*message);
    times[i]->get().bytes[0] = std::byte{1};
  }
  EXPECT_LT(resident_bytes(), before + kAll / 4);
}

TEST(SetAside, MakesAnObjectWhenItIsAskedForAndDestroysIt) {
  struct Counted {
    Counted() { ++alive(); }
    ~Counted() { --alive(); }
    static int& alive() {
      static int count = 0;
      return count;
    }
  };
  {
    SetAside<Counted> place;
    EXPECT_EQ(place.made(), nullptr);
    EXPECT_EQ(Counted::alive(), 0);
    Counted& made = place.get();
    EXPECT_EQ(&place.get(), &made);
    EXPECT_EQ(place.made(), &made);
    EXPECT_EQ(Counted::alive(), 1);
  }
  EXPECT_EQ(Counted::alive(), 0);
  const SetAside<Counted> never_asked;
  EXPECT_EQ(Counted::alive(), 0);
}

}  // namespace
}  // namespace takt
