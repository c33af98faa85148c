// What a workload's parameters may say.
// SPDX-License-Identifier: Apache-2.0
#include "takt/components/workload.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// A request, or a file, could take all memory of the machine.
TEST(Workload, HasABoundForItsMessages) {
  for (const std::int64_t bytes : {std::int64_t{1} << 40, std::int64_t{50'000'000}}) {
    const Parameters sizes{{"publishers.topic", std::vector<std::string>{"large"}},
                           {"publishers.period_us", std::vector<std::int64_t>{1000}},
                           {"publishers.size_bytes", std::vector<std::int64_t>{bytes}}};
    EXPECT_THAT([&] { Workload workload({.parameters = sizes}); },
                ThrowsMessage<Error>(HasSubstr("bytes are more than 1000 MB")))
        << bytes;
  }
  EXPECT_THAT(
      [] {
        Workload workload(
            {.parameters = {{"publishers.topic", std::vector<std::string>{"t"}},
                            {"publishers.period_us", std::vector<std::int64_t>{-1}}}});
      },
      ThrowsMessage<Error>(HasSubstr("parameter 'publishers.period_us' is -1; write 0 to")));
  EXPECT_THAT(
      [] {
        Workload workload({.parameters = {{"relays.input", std::vector<std::string>{"in"}},
                                          {"relays.output", std::vector<std::string>{"out"}},
                                          {"relays.size_bytes",
                                           std::vector<std::int64_t>{std::int64_t{1} << 40}}}});
      },
      ThrowsMessage<Error>(HasSubstr("bytes are more than 1000 MB")));
}

// Each is called as the node calls it, which names the second one of a topic NAME#2.
TEST(Workload, KnowsItsSecondCallbackOfATopic) {
  using Strings = std::vector<std::string>;
  const Workload workload({.parameters = {{"subscriptions.topic", Strings{"in"}},
                                          {"relays.input", Strings{"in", "in"}},
                                          {"relays.output", Strings{"a", "b"}},
                                          {"relays.work_us", std::vector<std::int64_t>{10, 20}}}});
  EXPECT_EQ(workload.execution_time("in#2"), std::chrono::microseconds(10));
  EXPECT_EQ(workload.execution_time("in#3"), std::chrono::microseconds(20));
  EXPECT_TRUE(workload.publishes("in#2", "/a"));
  EXPECT_TRUE(workload.publishes("in#3", "/b"));
  EXPECT_FALSE(workload.publishes("in", "/a"));
  EXPECT_FALSE(workload.publishes("in#2", "/b"));
  // Also where the first one is a timer.
  const Workload timed({.parameters = {{"publishers.topic", Strings{"in"}},
                                       {"publishers.period_us", std::vector<std::int64_t>{1000}},
                                       {"subscriptions.topic", Strings{"in_timer"}},
                                       {"subscriptions.work_us", std::vector<std::int64_t>{10}}}});
  EXPECT_EQ(timed.execution_time("in_timer#2"), std::chrono::microseconds(10));
}

}  // namespace
}  // namespace takt
