// SPDX-License-Identifier: Apache-2.0
#include "bench/claims.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/measuring/output.hpp"
#include "takt/measuring/ratio.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// Fewer pairs cannot tell a difference from chance.
constexpr std::size_t kLeastRepeats = 6;

const char* verdict_of(bool holds, bool is_refuted) {
  return holds ? "holds" : is_refuted ? "refuted" : "open";
}

bool are_positive(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return value > 0; });
}

/// Adds what the pairs say.
void decide(std::vector<double> less, std::vector<double> more, json& result) {
  const std::size_t repeats = std::min(less.size(), more.size());
  less.resize(repeats);
  more.resize(repeats);
  result["repeats"] = repeats;
  const bool are_enough = repeats >= kLeastRepeats;
  if (repeats >= 2 && are_positive(less) && are_positive(more)) {
    const rt::Ratio ratio = rt::ratio_of_pairs(less, more);
    result["ratio"] = ratio.value;
    result["low"] = ratio.low;
    result["high"] = ratio.high;
    result["verdict"] = verdict_of(are_enough && ratio.high < 1, are_enough && ratio.low > 1);
    return;
  }
  const bool holds = std::equal(less.begin(), less.end(), more.begin(), std::less<>());
  const bool is_refuted =
      std::equal(less.begin(), less.end(), more.begin(), std::greater_equal<>());
  result["verdict"] = verdict_of(are_enough && holds, are_enough && is_refuted);
}

/// Adds whether all are 0.
void decide(const std::vector<double>& values, json& result) {
  result["repeats"] = values.size();
  const bool are_zero = std::all_of(values.begin(), values.end(), [](double v) { return v == 0; });
  const bool are_enough = values.size() >= kLeastRepeats;
  result["verdict"] = verdict_of(are_enough && are_zero, are_enough && !are_zero);
}

}  // namespace

json try_claims(const Experiment& experiment, const std::vector<Variant>& variants,
                const ValuesOf& values_of) {
  json all = json::array();
  for (const Claim& claim : experiment.claims) {
    for (const Variant& less : variants) {
      const std::string end = less.is_simulated ? kSimulated : "";
      if (less.series != claim.less + end) continue;
      json result{{"text", claim.text},
                  {"metric", claim.metric},
                  {"less", claim.less},
                  {"more", claim.more},
                  {"simulated", less.is_simulated}};
      if (!experiment.x_label.empty()) result["x"] = less.x;
      if (claim.more.empty()) {
        decide(values_of(less, claim.metric), result);
      } else {
        const auto more = std::find_if(variants.begin(), variants.end(), [&](const auto& other) {
          return other.series == claim.more + end && other.x == less.x;
        });
        decide(values_of(less, claim.metric), values_of(*more, claim.metric), result);
      }
      if (result.at("repeats") != 0) all.push_back(std::move(result));
    }
  }
  return all;
}

void print_claims(const json& claims) {
  std::string text;
  for (const json& claim : claims) {
    if (claim.at("text") != text) {
      text = claim.at("text");
      rt::print("The paper says: {}\n", text);
    }
    std::string line =
        fmt::format("  {}{}: ", claim.at("simulated") ? "simulated" : "here",
                    claim.contains("x") ? fmt::format(" at {}", claim.at("x").get<double>()) : "");
    const std::string metric = claim.at("metric");
    const std::string less = claim.at("less"), more = claim.at("more");
    if (claim.contains("ratio")) {
      line += fmt::format("{} of {} is {:.3g} ({:.3g} to {:.3g}) of that of {}", metric, less,
                          claim.at("ratio").get<double>(), claim.at("low").get<double>(),
                          claim.at("high").get<double>(), more);
    } else if (more.empty()) {
      line += fmt::format("{} of {} is {}", metric, less,
                          claim.at("verdict") == "refuted" ? "not always 0" : "0");
    } else {
      line += fmt::format("{} of {} against that of {}", metric, less, more);
    }
    rt::print("{}, {} runs each: {}\n", line, claim.at("repeats").get<std::size_t>(),
              claim.at("verdict").get<std::string>());
  }
}

}  // namespace takt::tools
