// SPDX-License-Identifier: Apache-2.0
#include "latency/output.hpp"

#include <sstream>

#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using namespace std::chrono_literals;

/// A row whose latencies are all the same.
class Late final : public rt::CyclicVariant {
 public:
  Late() : CyclicVariant({.bins = 1}, "clock_nanosleep") {}

 private:
  void run(std::uint64_t cycles, const std::atomic<bool>&) override {
    for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) record(188'743'680ns, TimePoint());
  }
};

// From 100 ms on they ran together: "19136.51188743.68".
TEST(LatencyOutput, KeepsItsColumnsApartHoweverLateARowIs) {
  Rows rows;
  rows.push_back(std::make_unique<Late>());
  const std::atomic<bool> stop{false};
  rows[0]->round(10, stop);
  testing::internal::CaptureStdout();
  print_details(rows, rows[0]->options(), {});
  std::istringstream text(testing::internal::GetCapturedStdout());
  std::string line;
  while (std::getline(text, line) && !line.starts_with("# 0 ")) {
  }
  std::istringstream words(line);
  std::string sharp, number, name, p50, p99, p999, ratio;
  words >> sharp >> number >> name >> p50 >> p99 >> p999 >> ratio;
  EXPECT_EQ(name, "clock_nanosleep") << line;
  EXPECT_GT(std::stod(p99), 180'000) << line;
  EXPECT_EQ(p50, p99) << line;
  EXPECT_EQ(p999, p99) << line;
  EXPECT_EQ(ratio, "1.00") << line;
}

}  // namespace
}  // namespace takt::tools
