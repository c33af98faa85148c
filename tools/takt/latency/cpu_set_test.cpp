// SPDX-License-Identifier: Apache-2.0
#include "latency/cpu_set.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/error.hpp"

namespace takt::tools {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(CpuSet, IsAListOfCpusAndRangesInThisOrder) {
  const std::vector<int>& available = available_cpus();
  const int first = available.front();
  EXPECT_THAT(parse_cpu_set(fmt::format("{}", first)), ElementsAre(first));
  EXPECT_THAT(parse_cpu_set(fmt::format("{0}-{0}", first)), ElementsAre(first));
  EXPECT_EQ(parse_cpu_set("all"), available);
  if (available.size() < 2 || available[1] != first + 1) {
    GTEST_SKIP() << "no two CPUs one after the other";
  }
  EXPECT_THAT(parse_cpu_set(fmt::format("{}-{}", first, first + 1)), ElementsAre(first, first + 1));
  EXPECT_THAT(parse_cpu_set(fmt::format("{},{}", first + 1, first)), ElementsAre(first + 1, first));
}

TEST(CpuSet, RefusesWhatIsNoneAndSaysWhichThereAre) {
  for (const char* wrong : {"x", "1-", "-1", "1-0", "", ",", "100000", "0x1", "99999999999999"}) {
    EXPECT_THAT([&] { parse_cpu_set(wrong); },
                ThrowsMessage<Error>(HasSubstr("is not a CPU that this process may use")))
        << wrong;
  }
}

}  // namespace
}  // namespace takt::tools
