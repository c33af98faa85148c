// The libFuzzer target that runs the executors through rclcpp: see `./dev fuzz`.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/sequence.hpp"

#include "rclcpp_api.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  rclcpp::RclcppApi api;
  takt::sequences::require({data, size}, api);
  return 0;
}
