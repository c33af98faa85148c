// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/ratio.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/testing/sanitized.hpp"

namespace takt::rt {
namespace {

using testing::Each;
using testing::Gt;
using testing::MatchesRegex;
using testing::StartsWith;

using Values = std::vector<double>;

/// `n` ratios around `middle`, alternately above and below by a fraction `spread`.
Ratio around(double middle, double spread, std::size_t n) {
  Values values(n), ones(n, 1);
  for (std::size_t i = 0; i < n; ++i) values[i] = middle * std::exp(i % 2 == 0 ? spread : -spread);
  return ratio_of_pairs(values, ones);
}

TEST(Ratio, IsTheGeometricMeanOfThePairsAndNotThatOfTheMeans) {
  // The machine becomes three times as slow, for both.
  const Ratio ratio = ratio_of_pairs(Values{2, 2, 2, 6, 6, 6}, Values{1, 1, 1, 3, 3, 3});
  EXPECT_NEAR(ratio.value, 2, 1e-9);
  EXPECT_NEAR(ratio.low, 2, 1e-6);
  EXPECT_NEAR(ratio.high, 2, 1e-6);
  EXPECT_LT(ratio.p, 1e-9);
}

TEST(Ratio, HasStudentsIntervalOfTheLogarithms) {
  // Logarithms 1, 2, 3: mean 2, standard error 1/√3, and t = 4.3027 with two degrees of freedom.
  const Ratio ratio =
      ratio_of_pairs(Values{std::exp(1), std::exp(2), std::exp(3)}, Values{1, 1, 1});
  EXPECT_NEAR(std::log(ratio.value), 2, 1e-12);
  EXPECT_NEAR(std::log(ratio.high), 2 + 4.302653 / std::sqrt(3), 1e-5);
  EXPECT_NEAR(std::log(ratio.low), 2 - 4.302653 / std::sqrt(3), 1e-5);
  EXPECT_NEAR(ratio.p, 0.0742, 1e-4);
}

TEST(Ratio, OfGroupsIsWelchs) {
  // Logarithms 1 2 3 4 against 2 4 6: t = -1.134 with 3.23 degrees of freedom (R's t.test).
  const auto exps = [](Values values) {
    for (double& value : values) value = std::exp(value);
    return values;
  };
  const Ratio ratio = ratio_of_groups(exps({1, 2, 3, 4}), exps({2, 4, 6}));
  EXPECT_NEAR(std::log(ratio.value), -1.5, 1e-9);
  const double error = std::sqrt(5.0 / 3 / 4 + 4.0 / 3);
  const double freedom =
      std::pow(error, 4) / (std::pow(5.0 / 12, 2) / 3 + std::pow(4.0 / 3, 2) / 2);
  EXPECT_NEAR(freedom, 3.23, 0.01);
  EXPECT_GT(std::log(ratio.high), -1.5 + 3.0 * error);  // t of 3.23: 3.06
  EXPECT_LT(std::log(ratio.high), -1.5 + 3.2 * error);
  EXPECT_EQ(ratio.other_repeats, 3u);
}

TEST(Ratio, OfEqualValuesIsOneAndNotReal) {
  const Values values(8, 12.34), other(5, 12.34);
  for (const Ratio& ratio : {ratio_of_pairs(values, values), ratio_of_groups(values, other)}) {
    EXPECT_NEAR(ratio.value, 1, 1e-12);
    EXPECT_GT(ratio.p, 0.9);
  }
}

TEST(Ratio, NeedsTwoPairsAboveZero) {
  EXPECT_THROW(ratio_of_pairs(Values{}, Values{}), Error);
  EXPECT_THROW(ratio_of_pairs(Values{1}, Values{1}), Error);
  EXPECT_THROW(ratio_of_pairs(Values{1, 2}, Values{1}), Error);
  EXPECT_THROW(ratio_of_pairs(Values{1, 0}, Values{1, 1}), Error);
  EXPECT_THROW(ratio_of_pairs(Values{1, std::nan("")}, Values{1, 1}), Error);
  EXPECT_THROW(ratio_of_groups(Values{1, 2}, Values{-1, 1}), Error);
}

TEST(Decide, BelowSixRepeatsThereIsNoVerdict) {
  const Ratio few = around(2, 0.01, kLeastRepeats - 1), enough = around(2, 0.01, kLeastRepeats);
  const std::vector<Decision> decisions = decide(std::vector{few, enough});
  EXPECT_EQ(decisions[0].verdict, Verdict::none);
  EXPECT_EQ(decisions[1].verdict, Verdict::real);
  const Ratio to_few = ratio_of_groups(Values{2, 2.1, 2, 2.1, 2, 2.1, 2}, Values{1, 1.01, 1, 1.01});
  EXPECT_EQ(decide(std::vector{to_few})[0].verdict, Verdict::none);
}

TEST(Decide, SaysInWordsWhatDiffers) {
  const std::vector<Ratio> ratios{around(0.8, 0.02, 10), around(1.001, 0.01, 10),
                                  around(1.1, 0.2, 10), around(1.0001, 0.3, 10)};
  const std::vector<Decision> decisions = decide(ratios);
  EXPECT_EQ(text_of(ratios[0], decisions[0]), "real");
  EXPECT_THAT(text_of(ratios[1], decisions[1]), StartsWith("the same within 0."));
  EXPECT_THAT(text_of(ratios[2], decisions[2]), MatchesRegex("open: [0-9]+ repeats would decide"));
  EXPECT_EQ(text_of(ratios[3], decisions[3]), "open: 1000 repeats would not decide");
}

TEST(Decide, TheMoreRatiosATableHasTheMoreEachMustShow) {
  const Ratio ratio = around(1.1, 0.11, 10);  // p is about 0.02
  ASSERT_LT(ratio.p, 0.05);
  ASSERT_GT(ratio.p, 0.005);
  EXPECT_EQ(decide(std::vector{ratio})[0].verdict, Verdict::real);
  std::vector<Ratio> table(10, around(1, 0.11, 10));
  table.push_back(ratio);
  EXPECT_EQ(decide(table).back().verdict, Verdict::open);
  // What is certainly real does not count against the others.
  table.assign(10, around(2, 0.01, 10));
  table.push_back(ratio);
  EXPECT_EQ(decide(table).back().verdict, Verdict::real);
}

// ---- With recorded runs ----

/// Values by column, in the order of the runs.
using Columns = std::map<std::string, Values>;

const std::map<std::string, Columns>& recorded() {
  static const std::map<std::string, Columns> executors = [] {
    std::map<std::string, Columns> result;
    std::ifstream file(TAKT_COMPARED_RUNS);
    std::vector<std::string> names;
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with('#')) continue;
      std::istringstream words(line);
      std::string executor;
      words >> executor;
      if (names.empty()) {
        for (std::string name; words >> name;) names.push_back(name);
        continue;
      }
      for (const std::string& name : names) {
        double value = 0;
        words >> value;
        // As takt compare treats what can be 0.
        if (name == "wakeups" || name == "misses") value += 0.5;
        result[executor][name].push_back(value);
      }
    }
    return result;
  }();
  return executors;
}

constexpr int kSimulated = 2000;
constexpr std::size_t kRepeats = 10;

/// In which share of simulated comparisons of `values`, times a known ratio, with `to` this holds;
/// each value is drawn at random.
template <class RatioOf, class Holds>
double share(const Values& values, const Values& to, double known, const RatioOf& ratio_of,
             const Holds& holds) {
  std::mt19937 random(1);
  const auto draw = [&](const Values& from) {
    return from[std::uniform_int_distribution<std::size_t>(0, from.size() - 1)(random)];
  };
  int holding = 0;
  for (int i = 0; i < kSimulated; ++i) {
    Values first(kRepeats), second(kRepeats);
    for (std::size_t repeat = 0; repeat < kRepeats; ++repeat) {
      first[repeat] = known * draw(values);
      second[repeat] = draw(to);
    }
    holding += holds(ratio_of(first, second)) ? 1 : 0;
  }
  return static_cast<double>(holding) / kSimulated;
}

/// How often the interval has the truth in it: the ratio of the geometric means of all that was
/// recorded.
template <class RatioOf>
double covered(const Values& values, const Values& to, double known, const RatioOf& ratio_of) {
  const auto mean_log = [](const Values& of) {
    double sum = 0;
    for (const double value : of) sum += std::log(value);
    return sum / static_cast<double>(of.size());
  };
  const double truth = known * std::exp(mean_log(values) - mean_log(to));
  return share(values, to, known, ratio_of,
               [truth](const Ratio& ratio) { return ratio.low <= truth && truth <= ratio.high; });
}

bool is_real(const Ratio& ratio) {
  return decide(std::vector{ratio})[0].verdict == Verdict::real;
}

TEST(RecordedRuns, AreAllThere) {
  ASSERT_EQ(recorded().size(), 2u);
  for (const auto& [executor, columns] : recorded()) {
    ASSERT_EQ(columns.size(), 7u) << executor;
    for (const auto& [name, values] : columns) {
      EXPECT_EQ(values.size(), 80u) << name;
      EXPECT_THAT(values, Each(Gt(0))) << name;
    }
  }
}

TEST(RecordedRuns, TheIntervalCoversAKnownRatio) {
  for (const auto& [executor, columns] : recorded()) {
    for (const auto& [name, values] : columns) {
      for (const auto& ratio_of : {ratio_of_pairs, ratio_of_groups}) {
        EXPECT_GE(covered(values, values, 0.81, ratio_of), 0.92) << executor << name;
      }
    }
  }
}

/// Harder: one is more skewed than the other, so the mean of ten logarithms is skewed, too.
TEST(RecordedRuns, TheIntervalCoversTheRatioOfTwoExecutors) {
  const Columns& others = recorded().at("events");
  for (const auto& [name, values] : recorded().at("single_threaded")) {
    EXPECT_GE(covered(values, others.at(name), 1, ratio_of_pairs), 0.92) << name;
    EXPECT_GE(covered(values, others.at(name), 1, ratio_of_groups), 0.90) << name;
  }
}

TEST(RecordedRuns, EqualSystemsSeldomDiffer) {
  if (kFewerSanitized > 1) GTEST_SKIP() << "sanitizers see the same in the next test";
  for (const auto& [executor, columns] : recorded()) {
    for (const auto& [name, values] : columns) {
      EXPECT_LE(share(values, values, 1, ratio_of_pairs, is_real), 0.07) << executor << " " << name;
    }
  }
  for (const auto& [name, values] : recorded().at("events")) {
    EXPECT_LE(share(values, values, 1, ratio_of_groups, is_real), 0.07) << name;
  }
}

/// All figures of a run are drawn together, so they depend on each other as they do in fact.
TEST(RecordedRuns, ATableOfEqualSystemsSeldomHasARealDifference) {
  constexpr int kTables = 300, kRows = 5;
  const Columns& columns = recorded().at("events");
  std::mt19937 random(2);
  std::uniform_int_distribution<std::size_t> any(0, 79);
  const auto draw = [&] {
    std::vector<std::size_t> runs(kRepeats);
    std::generate(runs.begin(), runs.end(), [&] { return any(random); });
    return runs;
  };
  int with_real = 0;
  for (int i = 0; i < kTables; ++i) {
    std::vector<Ratio> table;
    const std::vector<std::size_t> first = draw();
    for (int row = 0; row < kRows; ++row) {
      const std::vector<std::size_t> other = draw();
      for (const auto& [name, values] : columns) {
        Values of, to;
        for (const std::size_t run : other) of.push_back(values[run]);
        for (const std::size_t run : first) to.push_back(values[run]);
        table.push_back(ratio_of_pairs(of, to));
      }
    }
    const std::vector<Decision> decisions = decide(table);
    with_real += std::any_of(decisions.begin(), decisions.end(),
                             [](const auto& each) { return each.verdict == Verdict::real; })
                     ? 1
                     : 0;
  }
  EXPECT_LE(with_real, kTables * 7 / 100);
}

/// The number that "open" names: with so many, a difference of this size is found 4 times of 5.
TEST(RecordedRuns, AsManyRepeatsAsSaidDecide) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.1);
  const auto draw = [&](std::size_t repeats) {
    Values values(repeats), ones(repeats, 1);
    for (double& value : values) value = 1.06 * std::exp(noise(random));
    return ratio_of_pairs(values, ones);
  };
  Ratio ratio = around(1.06, 0.1 * std::sqrt(0.9), 10);
  const std::optional<std::size_t> repeats = decide(std::vector{ratio})[0].repeats;
  ASSERT_TRUE(repeats);
  int found = 0;
  for (int i = 0; i < kSimulated; ++i) {
    found += is_real(draw(*repeats)) ? 1 : 0;
  }
  EXPECT_GT(found, kSimulated * 75 / 100) << *repeats;
  EXPECT_LT(found, kSimulated * 87 / 100) << *repeats;
}

}  // namespace
}  // namespace takt::rt
