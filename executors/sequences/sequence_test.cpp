// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "takt/executors/sequences/programs.hpp"
#include "takt/testing/sanitized.hpp"

namespace takt::sequences {
namespace {

constexpr int kPrograms = 1000 / kFewerSanitized;
constexpr const char* kRapidcheck =
    kFewerSanitized == 1 ? "seed=15 max_success=500" : "seed=15 max_success=50";

std::string run_takt(const Bytes& bytes) {
  Api api;
  return run(bytes, api);
}

class Sequence : public testing::TestWithParam<Kept> {};

TEST_P(Sequence, StaysRepaired) {
  EXPECT_EQ(run_takt(GetParam().bytes), "") << testing::PrintToString(GetParam().bytes);
}

INSTANTIATE_TEST_SUITE_P(Kept, Sequence, testing::ValuesIn(kept_programs()),
                         [](const auto& kept) { return kept.param.name; });

TEST(Sequences, ProgramsOfFixedSeedsKeepEveryPromise) {
  EXPECT_EQ(run_random(kPrograms, {}, [] { return std::make_unique<Api>(); }), "");
}

// The same too, unless RC_PARAMS says otherwise; of what fails, a small example is shown.
TEST(Sequences, RapidcheckFindsNoBrokenPromise) {
  setenv("RC_PARAMS", kRapidcheck, /*overwrite=*/0);
  EXPECT_TRUE(rc::check([](const Bytes& bytes) { RC_ASSERT(run_takt(bytes) == ""); }));
}

}  // namespace
}  // namespace takt::sequences
