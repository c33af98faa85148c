// Ratios of repeated measurements: an interval for each, and what can be said of many together.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_RATIO_HPP_
#define TAKT_MEASURING_RATIO_HPP_

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace takt::rt {

/// With fewer repeats there is no verdict: the interval would rest on the form of the distribution
/// more than on what was measured.
inline constexpr std::size_t kLeastRepeats = 6;

/// How many times as large one figure is as another. 1. Each value becomes its logarithm, so a
/// ratio and its inverse weigh the same. 2. The mean of the differences has a t distribution. Its
/// coverage is tested with recorded runs (ratio_test.cpp).
struct Ratio {
  double value = 1, low = 1, high = 1;  // geometric mean, and its 95 % confidence interval
  double p = 1;                         // how often equal systems differ as much
  std::size_t repeats = 0;              // pairs, or values of the first
  double variance = 0;                  // of the logarithm of one ratio, or one value of the first
  // Of the second, if these are no pairs.
  std::size_t other_repeats = 0;
  double other_variance = 0;
};

/// Of pairs that alternated: a slow minute of the machine falls on both. Throws Error if the
/// numbers differ, of fewer than two pairs, or if one is not above 0.
Ratio ratio_of_pairs(std::span<const double> values, std::span<const double> to);
/// Of values that were not measured in turn (Welch's t): how the machine changed in between is in
/// it. Throws Error as the other.
Ratio ratio_of_groups(std::span<const double> values, std::span<const double> to);

/// none: too few repeats. real: they differ. same: by less than 5 %, if at all. open: more repeats
/// would tell.
enum class Verdict { none, real, same, open };

struct Decision {
  Verdict verdict = Verdict::none;
  // Of open: so many would decide it 4 times of 5, if the ratio is as it looks. nullopt: over 1000.
  std::optional<std::size_t> repeats;
};

/// Of the ratios of one table. If all systems in it are equal, any is called real in at most 5 % of
/// such tables, however many ratios there are and however they depend on each other (Holm, 1979).
std::vector<Decision> decide(std::span<const Ratio> ratios);

/// How far from 1 the ratio may be.
double same_percent(const Ratio& ratio);

/// "real", "the same within 3.1 %", "open: 14 repeats would decide", or "no verdict".
std::string text_of(const Ratio& ratio, const Decision& decision);
/// "real", "same", "open" or "none", for files.
const char* word_of(Verdict verdict);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_RATIO_HPP_
