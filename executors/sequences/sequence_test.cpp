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

// Found once, each by chance; the comments say what was broken.
TEST(Sequences, WhatWasFoundStaysRepaired) {
  const std::vector<Bytes> seeds = {};
  for (const Bytes& seed : seeds) EXPECT_EQ(run(seed), "");
}

// The same programs each time: what fails once fails always.
TEST(Sequences, ProgramsOfFixedSeedsKeepEveryPromise) {
  const char* const asked = std::getenv("TAKT_SEQUENCES");
  const int programs = asked != nullptr ? std::atoi(asked) : 3000;
  std::mt19937 random(15);
  for (int program = 0; program < programs; ++program) {
    Bytes bytes(4 + random() % 200);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    ASSERT_EQ(run(bytes), "") << "program " << program << ": " << testing::PrintToString(bytes);
  }
}

// The same too, unless RC_PARAMS says otherwise; of what fails, a small example is shown.
TEST(Sequences, RapidcheckFindsNoBrokenPromise) {
  setenv("RC_PARAMS", "seed=15 max_success=500", /*overwrite=*/0);
  EXPECT_TRUE(rc::check([](const Bytes& bytes) { RC_ASSERT(run(bytes) == ""); }));
}

}  // namespace
}  // namespace takt::sequences
