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

/// What goes through rclcpp.
const std::vector<takt::sequences::Bytes> kOften{
    {0, 1},            // a node in the executor
    {1, 0, 0, 1},      // a timer
    {2, 0, 2, 0, 0},   // a subscription
    {4, 0},            // a message
    {22, 0, 0, 0, 2},  // a service
    {22, 0, 1, 0, 0},  // one that answers later
    {26, 0},           // which does so
    {23, 0, 0, 0, 1},  // a client
    {24, 0, 1},        // a request
    {39, 0},           // one with a future, for which it spins
    {10},              // a handle is dropped
    {8},               // nodes and groups are added
    {9},               // or removed
    {12, 200},         // time goes on
    {16, 7},           // calls in callbacks
    {18},              // a spin
    {20},              // and one until nothing is ready
    {36, 0},           // a parameter is set
    // What only rclcpp has: see own_calls.hpp.
    {63, 200, 4, 1, 1, 0, 0, 7, 1, 2, 1, 2},
    {63, 200, 3, 7, 0, 7, 0, 7, 0, 2},
    {63, 201, 1, 0},
    {63, 201, 4, 2},
    {63, 202, 5, 3, 4, 2, 1},
    {63, 203, 0, 3, 0, 0, 1, 1},
    {63, 203, 0, 0, 3},
    {63, 203, 0, 0, 1},
    {63, 204, 1, 2, 3, 5, 1, 9},
    {63, 205, 1, 1},
    {63, 206, 4, 1, 0, 9, 1, 3, 1, 0, 0},
    // A spin after some time, whose callbacks drop handles.
    {16, 7, 12, 200, 18, 0, 1, 0, 10, 0, 10, 1, 10, 2}};

TEST(RclcppSequences, ProgramsOfFixedSeedsKeepEveryPromise) {
  const auto make_api = [] { return std::make_unique<RclcppApi>(); };
  EXPECT_EQ(takt::sequences::run_random(kPrograms, kOften, make_api), "");
}
TEST(RclcppSequences, ProgramsThatOnceShowedADefectKeepThemToo) {
  for (const takt::sequences::Kept& kept : takt::sequences::kept_programs()) {
    RclcppApi api;
    EXPECT_EQ(takt::sequences::run(kept.bytes, api), "") << kept.name;
  }
}

}  // namespace
}  // namespace rclcpp
