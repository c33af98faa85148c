// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/sequence.hpp"

#include <cstdlib>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace takt::sequences {
namespace {

using Bytes = std::vector<std::uint8_t>;

#ifdef __SANITIZE_THREAD__
constexpr int kPrograms = 200;  // each takes twenty times as long
constexpr const char* kRapidcheck = "seed=15 max_success=50";
#else
constexpr int kPrograms = 1500;
constexpr const char* kRapidcheck = "seed=15 max_success=500";
#endif

// The shortest programs that showed what is repaired since.
TEST(Sequences, WhatWasFoundStaysRepaired) {
  const Bytes endless_spin_until{0, 0, 0, 19, 0, 1};
  const Bytes endless_spin_until_of_isolated{0, 2, 0, 0, 19, 0, 15};
  const Bytes time_out_for_ever{0, 0, 0, 19, 2};
  const Bytes period_for_ever{0, 0, 0, 0, 1, 1, 3};
  const Bytes timer_after_hold{0, 0, 0, 0, 1, 1, 0, 0, 0, 3, 0, 0, 17};
  const Bytes dropped_and_added_again{0, 10, 0, 0, 7, 3, 0, 14, 21, 0, 10, 0, 8, 0, 9};
  Bytes removed_while_callbacks_publish{8, 1, 0, 0, 1, 2, 0, 3, 0, 0};
  for (int i = 0; i < 40; ++i) {
    const Bytes remove_and_add{21, 0, 8, 0, 3};
    removed_while_callbacks_publish.insert(removed_while_callbacks_publish.end(),
                                           remove_and_add.begin(), remove_and_add.end());
  }
  for (const Bytes& program :
       {endless_spin_until, endless_spin_until_of_isolated, time_out_for_ever, period_for_ever,
        timer_after_hold, dropped_and_added_again, removed_while_callbacks_publish}) {
    EXPECT_EQ(run(program), "") << testing::PrintToString(program);
  }
}

// The same programs each time: what fails once fails always.
TEST(Sequences, ProgramsOfFixedSeedsKeepEveryPromise) {
  const char* const asked = std::getenv("TAKT_SEQUENCES");
  const int programs = asked != nullptr ? std::atoi(asked) : kPrograms;
  std::mt19937 random(15);
  for (int program = 0; program < programs; ++program) {
    Bytes bytes(4 + random() % 200);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    ASSERT_EQ(run(bytes), "") << "program " << program << ": " << testing::PrintToString(bytes);
  }
}

// The same too, unless RC_PARAMS says otherwise; of what fails, a small example is shown.
TEST(Sequences, RapidcheckFindsNoBrokenPromise) {
  setenv("RC_PARAMS", kRapidcheck, /*overwrite=*/0);
  EXPECT_TRUE(rc::check([](const Bytes& bytes) { RC_ASSERT(run(bytes) == ""); }));
}

}  // namespace
}  // namespace takt::sequences
