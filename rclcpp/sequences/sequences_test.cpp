// Random programs that speak rclcpp, against the model of what every executor promises: see
// executors/sequences/sequence.hpp.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "takt/executors/sequences/programs.hpp"

#include "rclcpp_api.hpp"

namespace rclcpp {
namespace {

#ifdef __SANITIZE_THREAD__
constexpr int kPrograms = 50;
#else
constexpr int kPrograms = 300;
#endif

TEST(RclcppSequences, ProgramsOfFixedSeedsKeepEveryPromise) {
  EXPECT_EQ(takt::sequences::run_random(kPrograms, [] { return std::make_unique<RclcppApi>(); }),
            "");
}
TEST(RclcppSequences, ProgramsThatOnceShowedADefectKeepThemToo) {
  for (const takt::sequences::Kept& kept : takt::sequences::kept_programs()) {
    RclcppApi api;
    EXPECT_EQ(takt::sequences::run(kept.bytes, api), "") << kept.name;
  }
}

}  // namespace
}  // namespace rclcpp
