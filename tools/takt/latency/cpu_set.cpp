// SPDX-License-Identifier: Apache-2.0
#include "latency/cpu_set.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/error.hpp"

namespace takt::tools {
namespace {

std::optional<int> number(std::string_view text) {
  int result = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), result);
  if (error != std::errc() || end != text.data() + text.size() || result < 0) return std::nullopt;
  return result;
}

}  // namespace

std::vector<int> parse_cpu_set(const std::string& text) {
  if (text == "all") return available_cpus();
  const std::vector<int>& available = usable_cpus();
  const auto refuse = [&](std::string_view part) {
    throw Error(
        fmt::format("CPU set '{}': '{}' is not a CPU that this process may use", text, part),
        fmt::format("use some of {}, such as 0-1 or 0,1", fmt::join(available, ",")));
  };
  std::vector<int> cpus;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view part = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    const std::size_t dash = part.find('-');
    const std::optional<int> first = number(part.substr(0, dash));
    const std::optional<int> last = dash == part.npos ? first : number(part.substr(dash + 1));
    if (!first || !last || *first > *last) refuse(part);
    for (int cpu = *first; cpu <= *last; ++cpu) {
      if (std::find(available.begin(), available.end(), cpu) == available.end()) refuse(part);
      cpus.push_back(cpu);
    }
  }
  if (cpus.empty()) refuse("");
  return cpus;
}

}  // namespace takt::tools
