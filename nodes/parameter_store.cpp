// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/parameter_store.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/never_destroyed.hpp"

namespace takt {
namespace {

std::string a_type(const ParameterValue& value) {
  const std::string_view name = type_name(value);
  if (std::holds_alternative<std::monostate>(value)) return std::string(name);
  return fmt::format("{} {}", name.starts_with('i') ? "an" : "a", name);
}

// As ROS 2 compares them: 0.3 is three steps of 0.1.
bool are_equal(double a, double b) {
  constexpr double kRoundings = 100;
  if (a == b || !std::isfinite(a) || !std::isfinite(b)) return a == b;
  constexpr double kRelative = kRoundings * std::numeric_limits<double>::epsilon();
  return std::abs(a - b) <= kRelative * std::abs(a) + kRelative * std::abs(b);
}

bool is_in(const IntegerRange& range, std::int64_t value) {
  if (value < range.from_value || value > range.to_value) return false;
  // Unsigned, as the range may be wider than the type.
  const auto from_begin =
      static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(range.from_value);
  return range.step == 0 || from_begin % range.step == 0 || value == range.to_value;
}

bool is_in(const FloatingPointRange& range, double value) {
  if (are_equal(value, range.from_value) || are_equal(value, range.to_value)) return true;
  if (!(value >= range.from_value && value <= range.to_value)) return false;  // or NaN
  if (range.step == 0) return true;
  const double steps = std::round((value - range.from_value) / range.step);
  return are_equal(value, range.from_value + steps * range.step);
}

template <class T>
using List = std::vector<T>;

bool is_empty_list(const ParameterValue& value) {
  const auto is_empty = []<class T>(const T& content) {
    if constexpr (detail::kIsList<T>) return content.empty();
    return false;
  };
  return std::visit(is_empty, value);
}

// The only conversions: an integer becomes a floating-point number; a list of integers, a list of
// these or of bytes if all fit; an empty list, a list of any type.
ParameterValue converted(const ParameterValue& value, const ParameterValue& other) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    if (std::holds_alternative<double>(other)) return static_cast<double>(*integer);
    return value;
  }
  if (is_empty_list(value)) {
    const auto empty = [&]<class T>(const T&) -> ParameterValue {
      if constexpr (detail::kIsList<T>) return T();
      return value;
    };
    return std::visit(empty, other);
  }
  const auto* integers = std::get_if<List<std::int64_t>>(&value);
  if (integers == nullptr) return value;
  if (std::holds_alternative<List<double>>(other)) {
    return List<double>(integers->begin(), integers->end());
  }
  const auto is_byte = [](std::int64_t integer) { return std::in_range<std::uint8_t>(integer); };
  if (std::holds_alternative<List<std::uint8_t>>(other) &&
      std::all_of(integers->begin(), integers->end(), is_byte)) {
    return List<std::uint8_t>(integers->begin(), integers->end());
  }
  return value;
}

template <class Range>
std::string text(const Range& range) {
  std::string result = fmt::format(" from {} to {}", range.from_value, range.to_value);
  if (range.step != 0) result += fmt::format(" in steps of {}", range.step);
  return result;
}

}  // namespace

ParameterStore::ParameterStore(std::string node, Parameters given, const Rules& rules)
    : node_(std::move(node)), given_(std::move(given)), rules_(rules) {
  for (const auto& [name, value] : given_) unused_.insert(name);
}

// The changes that these values make; throws Error when one cannot be set.
ParameterChanges ParameterStore::checked(const Parameters& values) const {
  ParameterChanges changes;
  const std::lock_guard lock(mutex_);
  for (const auto& [name, value] : values) {
    const Declared& declared = find_or_unset(name);
    if (declared.descriptor.read_only) {
      throw Error(fmt::format("parameter '{}' of node '{}' is read-only", name, node_),
                  "give its value in the configuration");
    }
    const bool is_set = !std::holds_alternative<std::monostate>(value);
    if (!is_set) check_undeclaring(name, declared);
    if (!declared_.contains(name)) {
      if (is_set) changes.added.try_emplace(name, value);
    } else if (is_set || std::holds_alternative<std::monostate>(declared.value)) {
      changes.changed.try_emplace(name, accepted(name, value, declared));
    } else {
      changes.deleted.push_back(name);
    }
  }
  return changes;
}

// A fixed type needs a value; a range must be valid, and of the parameter's type.
void ParameterStore::check_descriptor(std::string_view name, const Declared& declared) const {
  const auto& [value, descriptor, limits] = declared;
  if (!descriptor.dynamic_typing && std::holds_alternative<std::monostate>(value)) {
    throw Error(fmt::format("parameter '{}' of node '{}' is declared without a value", name, node_),
                "give one, which says its type, or dynamic_typing");
  }
  const auto check = [&](const auto& range, bool is_of_its_type) {
    if (!range) return;
    if (!is_of_its_type && !declared.descriptor.dynamic_typing) {
      throw Error(fmt::format("parameter '{}' of node '{}' is {}, and its range is of another type",
                              name, node_, a_type(declared.value)),
                  "give the range of its type, or none");
    }
    if (!(range->from_value <= range->to_value && range->step >= 0)) {
      throw Error(fmt::format("parameter '{}' of node '{}' cannot be in the range{}", name, node_,
                              text(*range)),
                  "give the smaller value first, and no negative step");
    }
  };
  check(descriptor.integer_range, std::holds_alternative<std::int64_t>(value));
  check(descriptor.floating_point_range, std::holds_alternative<double>(value));
}

void ParameterStore::check_undeclaring(std::string_view name, const Declared& declared) const {
  const auto refuse = [&](std::string_view why, std::string_view hint) {
    throw Error(
        fmt::format("parameter '{}' of node '{}' cannot be undeclared: {}", name, node_, why),
        std::string(hint));
  };
  if (declared.descriptor.read_only) refuse("it is read-only", "");
  if (!declared.descriptor.dynamic_typing) {
    refuse("its type is fixed", "declare it with dynamic_typing");
  }
}

// The value converted to the parameter's type; throws Error when it is not accepted.
ParameterValue ParameterStore::accepted(std::string_view name, const ParameterValue& given,
                                        const Declared& declared) const {
  const auto& descriptor = declared.descriptor;
  const auto refuse = [&](const ParameterValue& of_the_type, const std::string& range) {
    throw Error(
        fmt::format("parameter '{}' of node '{}' cannot be {}", name, node_, to_string(given)),
        fmt::format("give {}{}", a_type(of_the_type), range));
  };
  const auto check = [&](const auto& range, const auto& number) {
    if (!is_in(range, number)) refuse(number, text(range));
  };
  const ParameterValue value = descriptor.dynamic_typing || rules_.are_types_exact
                                   ? given
                                   : converted(given, declared.value);
  if (!descriptor.dynamic_typing && value.index() != declared.value.index()) {
    const auto& [integers, numbers] =
        std::tie(descriptor.integer_range, descriptor.floating_point_range);
    refuse(declared.value, integers ? text(*integers) : numbers ? text(*numbers) : "");
  }
  const IntegerRange limits{declared.limits.lowest, declared.limits.highest};
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    if (descriptor.integer_range) check(*descriptor.integer_range, *integer);
    check(limits, *integer);
  }
  if (const auto* integers = std::get_if<List<std::int64_t>>(&value)) {
    for (const std::int64_t integer : *integers) check(limits, integer);
  }
  const auto* number = std::get_if<double>(&value);
  if (number != nullptr && descriptor.floating_point_range) {
    check(*descriptor.floating_point_range, *number);
  }
  return value;
}

bool ParameterStore::has(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  return declared_.contains(name);
}

ParameterValue ParameterStore::get(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  return find(name).value;
}

ParameterValue ParameterStore::get_if_set(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  const auto found = declared_.find(name);
  return found != declared_.end() ? found->second.value : ParameterValue();
}

std::vector<Parameter> ParameterStore::get(const std::vector<std::string>& names) const {
  std::vector<Parameter> parameters;
  const std::lock_guard lock(mutex_);
  for (const std::string& name : names) parameters.push_back({name, find_or_unset(name).value});
  return parameters;
}

Parameters ParameterStore::get_by_prefix(std::string_view prefix) const {
  const std::string before = prefix.empty() ? "" : std::string(prefix) + ".";
  Parameters parameters;
  const std::lock_guard lock(mutex_);
  for (const auto& [name, declared] : declared_) {
    if (name.starts_with(before) && name != before) {
      parameters.emplace(name.substr(before.size()), declared.value);
    }
  }
  return parameters;
}

std::vector<ParameterDescriptor> ParameterStore::describe(
    const std::vector<std::string>& names) const {
  std::vector<ParameterDescriptor> descriptors;
  const std::lock_guard lock(mutex_);
  for (const std::string& name : names) descriptors.push_back(find_or_unset(name).descriptor);
  return descriptors;
}

const ParameterStore::Declared& ParameterStore::find_or_unset(std::string_view name) const {
  static detail::NeverDestroyed<const Declared> unset(Declared{{}, {.dynamic_typing = true}, {}});
  return rules_.allows_undeclared && !declared_.contains(name) ? *unset : find(name);
}

const ParameterStore::Declared& ParameterStore::find(std::string_view name) const {
  if (const auto found = declared_.find(name); found != declared_.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [declared, value] : declared_) names.push_back(declared);
  throw Error(fmt::format("node '{}' has no parameter '{}'", node_, name), suggest(name, names));
}

// As in ROS 2: a prefix is the name of a parameter, or the part of it before a dot; `depth` counts
// the parts after the prefix.
ListParametersResult ParameterStore::list(const std::vector<std::string>& prefixes,
                                          std::uint64_t depth) const {
  const auto is_within_depth = [&](std::string_view name) {
    return depth == 0 ||
           static_cast<std::uint64_t>(std::count(name.begin(), name.end(), '.')) < depth;
  };
  const auto is_asked_for = [&](std::string_view name) {
    if (prefixes.empty()) return is_within_depth(name);
    return std::any_of(prefixes.begin(), prefixes.end(), [&](const std::string& prefix) {
      if (name == prefix) return true;
      return name.starts_with(prefix + ".") && is_within_depth(name.substr(prefix.size() + 1));
    });
  };
  ListParametersResult result;
  const std::lock_guard lock(mutex_);
  for (const auto& [name, declared] : declared_) {
    if (!is_asked_for(name)) continue;
    result.names.push_back(name);
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) continue;
    const std::string prefix = name.substr(0, dot);
    if (std::find(result.prefixes.begin(), result.prefixes.end(), prefix) ==
        result.prefixes.end()) {
      result.prefixes.push_back(prefix);
    }
  }
  return result;
}

std::vector<std::string> ParameterStore::unused() const {
  const std::lock_guard lock(mutex_);
  return {unused_.begin(), unused_.end()};
}

void detail::refuse_type(const std::string& node, std::string_view name, const ParameterValue& is,
                         const ParameterValue& wanted) {
  throw Error(fmt::format("parameter '{}' of node '{}' is {}", name, node, a_type(is)),
              fmt::format("it cannot be read as {}", a_type(wanted)));
}

void detail::refuse_narrow(const std::string& node, std::string_view name,
                           const ParameterValue& is) {
  throw Error(fmt::format("parameter '{}' of node '{}' is {}", name, node, to_string(is)),
              "read it as a wider integer");
}

}  // namespace takt
