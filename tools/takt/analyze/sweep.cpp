// SPDX-License-Identifier: Apache-2.0
#include "analyze/sweep.hpp"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "takt/measuring/rounds.hpp"

#include "table.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

constexpr int kValues = 10;

bool is_number(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  return std::from_chars(text.data(), end, value).ptr == end;
}
bool is_integer(const std::string& text) {
  std::int64_t value = 0;
  const char* const end = text.data() + text.size();
  return std::from_chars(text.data(), end, value).ptr == end;
}

/// The texts of the values from A to B.
std::vector<std::string> values(const std::string& from, const std::string& to) {
  std::vector<std::string> result;
  const auto add = [&](std::string text) {
    if (result.empty() || result.back() != text) result.push_back(std::move(text));
  };
  for (int i = 0; i < kValues; ++i) {
    const auto between = [&](double first, double last) {
      return first + (last - first) * i / (kValues - 1);
    };
    if (is_number(from) && is_number(to)) {
      const double value = between(std::stod(from), std::stod(to));
      add(is_integer(from) && is_integer(to) ? fmt::format("{:.0f}", value)
                                             : fmt::format("{:g}", value));
    } else {
      const double value = between(static_cast<double>(parse_duration(from).count()),
                                   static_cast<double>(parse_duration(to).count()));
      add(to_string(std::chrono::round<std::chrono::microseconds>(
          std::chrono::duration<double, std::nano>(value))));
    }
  }
  return result;
}

}  // namespace

json sweep(const std::string& path, const AnalyzeOptions& options, const std::string& range,
           bool prints) {
  const std::size_t equals = range.find('='), dots = range.find("..", equals);
  if (equals == std::string::npos || dots == std::string::npos) {
    throw Error(fmt::format("'{}' is not a range of a key", range),
                "write KEY=A..B, such as threads.control.runtime=1ms..9ms");
  }
  const std::string key = range.substr(0, equals);
  json result{{"key", key}, {"points", json::array()}};
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> header{key};
  for (const std::string& value :
       values(range.substr(equals + 1, dots - equals - 1), range.substr(dots + 2))) {
    AnalyzeOptions changed = options;
    changed.settings.push_back({key, value});
    const AnalyzedFile file = analyze_file(path, changed);
    std::vector<std::string> row{value};
    json chains = json::array();
    for (std::size_t i = 0; i < file.model.chains.size(); ++i) {
      const auto& bound = file.bounds.chains[i].bound;
      if (rows.empty()) header.push_back(file.model.chains[i].name + "_ms");
      row.push_back(bound ? milliseconds(*bound) : "-");
      chains.push_back(
          {{"name", file.model.chains[i].name},
           {"bound_us", bound ? json(rt::us(*bound)) : json()},
           {"verdict", to_string(verdict(file.model.chains[i], file.bounds.chains[i]))}});
    }
    result["points"].push_back({{"value", value}, {"chains", std::move(chains)}});
    rows.push_back(std::move(row));
  }
  Table table(std::move(header));
  for (auto& row : rows) table.add(std::move(row));
  if (prints) table.print("bounds of the chains");
  return result;
}

}  // namespace takt::tools
