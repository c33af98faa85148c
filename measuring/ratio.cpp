// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/ratio.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <boost/math/distributions/students_t.hpp>
#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt::rt {
namespace {

constexpr double kLevel = 0.05, kPower = 0.8, kSame = 1.05;
constexpr std::size_t kRepeatsAllowed = 1000;  // that --repeat allows

using T = boost::math::students_t_distribution<double>;

/// The value that t is above with this probability.
double above(double freedom, double probability) {
  return boost::math::quantile(boost::math::complement(T(freedom), probability));
}

/// How far a mean of logarithms may be from the truth.
struct Uncertainty {
  double size, freedom;
};

struct Logs {
  double mean, variance;
};

Logs logs_of(std::span<const double> values) {
  if (values.size() < 2) throw Error("an interval needs two repeats");
  double sum = 0, squares = 0;
  for (const double value : values) {
    if (!(value > 0)) throw Error("a ratio needs values above 0");
    sum += std::log(value);
  }
  const auto count = static_cast<double>(values.size());
  for (const double value : values) squares += std::pow(std::log(value) - sum / count, 2);
  return {sum / count, squares / (count - 1)};
}

/// Of a ratio with the variances of this one, but another number of repeats.
Uncertainty error_of(const Ratio& ratio, std::size_t repeats) {
  constexpr double kLeastError = 1e-9;  // of the arithmetic, where all ratios are the same
  const auto count = static_cast<double>(repeats);
  const double part = ratio.variance / count;
  if (ratio.other_repeats == 0) return {std::max(std::sqrt(part), kLeastError), count - 1};
  const auto other_count = static_cast<double>(ratio.other_repeats);
  const double other = ratio.other_variance / other_count;
  const double below = part * part / (count - 1) + other * other / (other_count - 1);
  const double most = count + other_count - 2;
  return {std::max(std::sqrt(part + other), kLeastError),
          below > 0 ? std::min((part + other) * (part + other) / below, most) : most};
}

/// `ratio` has all but these fields.
Ratio with_interval(Ratio ratio, double mean) {
  const auto [error, freedom] = error_of(ratio, ratio.repeats);
  const double half = above(freedom, kLevel / 2) * error;
  ratio.value = std::exp(mean);
  ratio.low = std::exp(mean - half);
  ratio.high = std::exp(mean + half);
  ratio.p = 2 * boost::math::cdf(boost::math::complement(T(freedom), std::abs(mean) / error));
  return ratio;
}

std::optional<std::size_t> repeats_to_decide(const Ratio& ratio, double level) {
  const double size = std::abs(std::log(ratio.value));
  std::size_t too_few = ratio.repeats, enough = kRepeatsAllowed + 1;
  while (too_few + 1 < enough) {
    const std::size_t middle = too_few + (enough - too_few) / 2;
    const auto [error, freedom] = error_of(ratio, middle);
    const bool is_enough = size >= (above(freedom, level / 2) + above(freedom, 1 - kPower)) * error;
    (is_enough ? enough : too_few) = middle;
  }
  return enough > kRepeatsAllowed ? std::nullopt : std::optional(enough);
}

}  // namespace

Ratio ratio_of_pairs(std::span<const double> values, std::span<const double> to) {
  if (values.size() != to.size()) throw Error("a ratio needs pairs of values");
  std::vector<double> ratios(values.size());
  std::transform(values.begin(), values.end(), to.begin(), ratios.begin(), std::divides());
  const Logs logs = logs_of(ratios);
  return with_interval({.repeats = values.size(), .variance = logs.variance}, logs.mean);
}

Ratio ratio_of_groups(std::span<const double> values, std::span<const double> to) {
  const Logs logs = logs_of(values), others = logs_of(to);
  return with_interval({.repeats = values.size(),
                        .variance = logs.variance,
                        .other_repeats = to.size(),
                        .other_variance = others.variance},
                       logs.mean - others.mean);
}

std::vector<Decision> decide(std::span<const Ratio> ratios) {
  std::vector<Decision> decisions(ratios.size());
  std::vector<std::size_t> order;  // of those with a verdict, by p
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    const std::size_t others = ratios[i].other_repeats;
    if (ratios[i].repeats >= kLeastRepeats && (others == 0 || others >= kLeastRepeats)) {
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return ratios[a].p < ratios[b].p; });
  std::size_t left = order.size();
  for (const std::size_t i : order) {
    if (ratios[i].p > kLevel / static_cast<double>(left)) break;
    decisions[i].verdict = Verdict::real;
    --left;
  }
  for (const std::size_t i : std::span(order).last(left)) {
    const Ratio& ratio = ratios[i];
    if (ratio.low >= 1 / kSame && ratio.high <= kSame) {
      decisions[i].verdict = Verdict::same;
    } else {
      decisions[i] = {Verdict::open, repeats_to_decide(ratio, kLevel / static_cast<double>(left))};
    }
  }
  return decisions;
}

double same_percent(const Ratio& ratio) {
  return 100 * (std::max(ratio.high, 1 / ratio.low) - 1);
}

std::string text_of(const Ratio& ratio, const Decision& decision) {
  switch (decision.verdict) {
    case Verdict::none:
      return "no verdict";
    case Verdict::real:
      return "real";
    case Verdict::same:
      return fmt::format("the same within {:.1f} %", same_percent(ratio));
    case Verdict::open:
      return decision.repeats ? fmt::format("open: {} repeats would decide", *decision.repeats)
                              : fmt::format("open: {} repeats would not decide", kRepeatsAllowed);
  }
  return "";
}

const char* word_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::real:
      return "real";
    case Verdict::same:
      return "same";
    case Verdict::open:
      return "open";
    case Verdict::none:
      break;
  }
  return "none";
}

}  // namespace takt::rt
