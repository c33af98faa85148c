// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/scenario.hpp"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

[[noreturn]] void refuse_word(std::string_view word, const std::string& why) {
  throw Error(fmt::format("'{}' is no scenario: {}", word, why),
              "write SEED,worst|drawn, phases and faults, as "
              "7,worst,all=0s,/camera/image_timer=3ms,lost=/planner/image@2s; "
              "`takt simulate` shows those of its runs");
}

std::vector<std::string_view> parts_of(std::string_view word) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= word.size();) {
    const std::size_t end = std::min(word.find(',', begin), word.size());
    parts.push_back(word.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

}  // namespace

std::string to_string(const Scenario& scenario) {
  std::string word = fmt::format("{},{}", scenario.seed,
                                 scenario.times == Scenario::Times::worst ? "worst" : "drawn");
  const auto all = scenario.phases.find(Scenario::kAll);
  if (all != scenario.phases.end())
    word += fmt::format(",{}={}", all->first, to_string(all->second));
  for (const auto& [callback, phase] : scenario.phases) {
    if (callback != Scenario::kAll) word += fmt::format(",{}={}", callback, to_string(phase));
  }
  for (const Fault& fault : scenario.faults) word += "," + to_string(fault);
  return word;
}

Scenario parse_scenario(std::string_view word) {
  const std::vector<std::string_view> parts = parts_of(word);
  Scenario scenario{.seed = 0, .times = Scenario::Times::worst, .phases = {}};
  const std::string_view seed = parts[0];
  const auto [end, error] = std::from_chars(seed.data(), seed.data() + seed.size(), scenario.seed);
  if (error != std::errc() || end != seed.data() + seed.size())
    refuse_word(word, fmt::format("'{}' is no seed, which is a whole number", seed));
  if (parts.size() < 2 || (parts[1] != "worst" && parts[1] != "drawn"))
    refuse_word(word, "after the seed stands worst or drawn, of execution times");
  if (parts[1] == "drawn") scenario.times = Scenario::Times::drawn;
  for (std::size_t i = 2; i < parts.size(); ++i) {
    const std::size_t equals = parts[i].rfind('=');
    if (equals == parts[i].npos || equals == 0)
      refuse_word(word, fmt::format("'{}' is no NAME=TIME", parts[i]));
    const std::string name(parts[i].substr(0, equals));
    if (is_fault_kind(name)) {
      scenario.faults.push_back(parse_fault(name, parts[i].substr(equals + 1)));
      continue;
    }
    const Nanoseconds phase = parse_duration(parts[i].substr(equals + 1));
    if (!scenario.phases.emplace(name, phase).second)
      refuse_word(word, fmt::format("'{}' is there twice", name));
  }
  return scenario;
}

}  // namespace takt
