// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/fault.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

// In the order of Fault::Kind.
constexpr std::array<std::string_view, 7> kFaultKinds{"lost", "late", "doubled", "reordered",
                                                      "full", "slow", "throws"};

}  // namespace

std::string_view to_string(Fault::Kind kind) noexcept {
  return kFaultKinds[static_cast<std::size_t>(kind)];
}

std::string to_string(const Fault& fault) {
  std::string word =
      fmt::format("{}={}@{}", to_string(fault.kind), fault.callback, to_string(fault.time));
  if (fault.kind == Fault::Kind::late) word += "+" + to_string(fault.span);
  return word;
}

bool is_fault_kind(std::string_view word) noexcept {
  return std::find(kFaultKinds.begin(), kFaultKinds.end(), word) != kFaultKinds.end();
}

Fault parse_fault(std::string_view kind, std::string_view what) {
  const auto number = std::find(kFaultKinds.begin(), kFaultKinds.end(), kind) - kFaultKinds.begin();
  Fault fault{.kind = static_cast<Fault::Kind>(number), .callback = {}};
  const bool is_late = fault.kind == Fault::Kind::late;
  const std::size_t at = what.rfind('@'), plus = what.rfind('+');
  if (at == what.npos || at == 0 || is_late != (plus != what.npos && plus > at)) {
    throw Error(fmt::format("'{}={}' is no fault", kind, what),
                is_late ? "write late=CALLBACK@TIME+TIME, as late=/planner/imu@3s+20ms"
                        : fmt::format("write {}=CALLBACK@TIME, as {}=/planner/imu@3s", kind, kind));
  }
  fault.callback = what.substr(0, at);
  fault.time = parse_duration(what.substr(at + 1, is_late ? plus - at - 1 : what.npos));
  if (is_late) fault.span = parse_duration(what.substr(plus + 1));
  return fault;
}

FaultKinds parse_fault_kinds(std::string_view list) {
  FaultKinds kinds;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    const std::string_view word = list.substr(begin, end - begin);
    begin = end + 1;
    if (word != "all" && !is_fault_kind(word)) {
      const bool is_clock = word == "clock" || word == "jump";
      throw Error(
          fmt::format("'{}' is no kind of fault{}", word,
                      is_clock ? ": timers follow the steady clock, which does not jump" : ""),
          fmt::format("valid: {}, all", fmt::join(kFaultKinds, ", ")));
    }
    for (std::size_t kind = 0; kind < kFaultKinds.size(); ++kind) {
      if (word == "all" || word == kFaultKinds[kind]) kinds.insert(static_cast<Fault::Kind>(kind));
    }
  }
  return kinds;
}

}  // namespace takt
