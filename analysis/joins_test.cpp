// How long a join waits for its other inputs.
// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include <gtest/gtest.h>

#include "takt/analysis/analysis.hpp"

namespace takt::analysis {
namespace {

// It waited for the next message of its own, 100 later, though the others come every 30 and 10.
TEST(Analysis, AJoinWaitsForTheOtherInputsAtMost) {
  const auto chain = [](std::optional<Count> depth, Time beside = 0) {
    System system{.executors = {{.name = "a"}, {.name = "b"}, {.name = "c"}, {.name = "end"}}};
    for (const Time period : {100, 30, 10}) {
      system.callbacks.push_back({.name = "timer",
                                  .executor = system.callbacks.size(),
                                  .execution = 1,
                                  .arrivals = ArrivalCurve::periodic(period),
                                  .longest_gap = period,
                                  .is_timer = true,
                                  .depth = period == 30 ? depth : std::nullopt,
                                  .outputs = {{.to = 3, .messages = 0, .waits = true}}});
    }
    system.callbacks[0].outputs[0].messages = 1;
    system.callbacks.push_back({.name = "joined", .executor = 3, .execution = 1});
    if (beside != 0) {
      system.callbacks.push_back({.name = "beside",
                                  .executor = 1,
                                  .execution = beside,
                                  .arrivals = ArrivalCurve::periodic(200)});
    }
    system.chains = {{.name = "c", .callbacks = {0, 3}}};
    return analyze(system).chains[0].bound;
  };
  EXPECT_EQ(chain(std::nullopt), 1 + 30 + 1 + 1);
  // The timer of 30 may miss a release, and its next message is one later.
  EXPECT_EQ(chain(std::nullopt, 35), 1 + 60 + 36 + 1);
  EXPECT_GT(chain(0), 100);  // what may be lost does not come
}

}  // namespace
}  // namespace takt::analysis
