// What is said of a paper's claim.
// SPDX-License-Identifier: Apache-2.0
#include "bench/claims.hpp"

#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using Values = std::vector<double>;

/// The verdict about "less is less than more", with these values.
nlohmann::json tried(const Values& less, const Values& more) {
  const Experiment experiment{.name = "e",
                              .title = "",
                              .x_label = "",
                              .metrics = {"m"},
                              .variants = {},
                              .deviations = {},
                              .claims = {{"It is less.", "m", "less", "more"}}};
  const std::vector<Variant> variants{{.series = "more"}, {.series = "less"}};
  const nlohmann::json claims =
      try_claims(experiment, variants, [&](const Variant& variant, const std::string& metric) {
        EXPECT_EQ(metric, "m");
        return variant.series == "less" ? less : more;
      });
  EXPECT_EQ(claims.size(), 1u);
  return claims.at(0);
}

TEST(Claims, HoldIfTheIntervalLiesBelowOne) {
  const nlohmann::json claim = tried({2, 2.1, 1.9, 2, 2.1, 1.9}, {4, 4, 4, 4.1, 4.1, 3.9});
  EXPECT_EQ(claim.at("verdict"), "holds");
  EXPECT_NEAR(claim.at("ratio").get<double>(), 0.5, 0.02);
  EXPECT_LT(claim.at("high").get<double>(), 0.6);
  EXPECT_EQ(claim.at("repeats"), 6);
}

TEST(Claims, AreRefutedIfItLiesAbove) {
  EXPECT_EQ(tried({4, 4, 4, 4.1, 4.1, 3.9}, {2, 2.1, 1.9, 2, 2.1, 1.9}).at("verdict"), "refuted");
}

TEST(Claims, AreOpenIfTheIntervalContainsOneOrRunsAreFew) {
  EXPECT_EQ(tried({2, 8, 2, 8, 2, 8}, {4, 4, 4, 4, 4, 4}).at("verdict"), "open");
  EXPECT_EQ(tried({2, 2, 2}, {4, 4, 4}).at("verdict"), "open");
  EXPECT_EQ(tried({4, 4, 4, 4, 4, 4}, {4, 4, 4, 4, 4, 4}).at("verdict"), "open");
}

TEST(Claims, CompareEachRunWhereARatioCannotBe) {
  const nlohmann::json claim = tried({0, 0, 0, 0, 0, 1}, {4, 4, 4, 4, 4, 4});
  EXPECT_EQ(claim.at("verdict"), "holds");
  EXPECT_FALSE(claim.contains("ratio"));
  EXPECT_EQ(tried({1, 1, 1, 1, 1, 1}, {0, 0, 0, 0, 0, 0}).at("verdict"), "refuted");
  EXPECT_EQ(tried({0, 2, 0, 0, 0, 0}, {1, 1, 1, 1, 1, 1}).at("verdict"), "open");
}

// At each x, here and simulated; one series may be 0 in each run.
TEST(Claims, AreTriedAtEachX) {
  const Experiment experiment{.name = "e",
                              .title = "",
                              .x_label = "x",
                              .metrics = {"m"},
                              .variants = {},
                              .deviations = {},
                              .claims = {{"None.", "m", "one", ""}}};
  const std::vector<Variant> variants{
      {.series = "one", .x = 4},
      {.series = "one", .x = 5},
      {.series = std::string("one") + kSimulated, .x = 4, .is_simulated = true}};
  const nlohmann::json claims =
      try_claims(experiment, variants, [](const Variant& variant, const std::string&) {
        return variant.x == 5 ? Values{0, 0, 0, 0, 0, 1} : Values(6);
      });
  ASSERT_EQ(claims.size(), 3u);
  EXPECT_EQ(claims.at(0).at("verdict"), "holds");
  EXPECT_EQ(claims.at(1).at("verdict"), "refuted");
  EXPECT_EQ(claims.at(1).at("x"), 5);
  EXPECT_EQ(claims.at(2).at("verdict"), "holds");
  EXPECT_TRUE(claims.at(2).at("simulated"));
}

}  // namespace
}  // namespace takt::tools
