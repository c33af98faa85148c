// What libFuzzer runs against the executors: any bytes are a legal program. See sequence.hpp, and
// `./dev fuzz`.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/sequence.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  takt::sequences::Api api;
  takt::sequences::require({data, size}, api);
  return 0;
}
