// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/node_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

std::string a_type(const ParameterValue& value) {
  const std::string_view name = type_name(value);
  return fmt::format("{} {}", name.starts_with('i') ? "an" : "a", name);
}

// As ROS 2 compares them: 0.3 is three steps of 0.1.
bool are_equal(double a, double b) {
  constexpr double kRoundings = 100;
  return std::abs(a - b) <= kRoundings * std::numeric_limits<double>::epsilon() * std::abs(a + b);
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
  if (!(value >= range.from_value && value <= range.to_value)) return false;  // or it is no number
  if (range.step == 0) return true;
  const double steps = std::round((value - range.from_value) / range.step);
  return are_equal(value, range.from_value + steps * range.step);
}

template <class Range>
std::string text(const Range& range) {
  std::string result = fmt::format(" from {} to {}", range.from_value, range.to_value);
  if (range.step != 0) result += fmt::format(" in steps of {}", range.step);
  return result;
}

}  // namespace

// Lets one thread at a time change parameters. A callback that is called for a change and makes one
// would wait for itself.
class NodeParameters::Changing {
 public:
  Changing(NodeParameters& parameters, std::string_view what) : parameters_(parameters) {
    if (parameters.changing_thread_.load() == std::this_thread::get_id()) {
      throw Error(fmt::format("node '{}': a callback that is called before parameters are set {}",
                              parameters.node_, what),
                  "do it after the callback");
    }
    parameters.change_mutex_.lock();
    parameters.changing_thread_.store(std::this_thread::get_id());
  }
  ~Changing() {
    parameters_.changing_thread_.store({});
    parameters_.change_mutex_.unlock();
  }
  Changing(const Changing&) = delete;
  Changing& operator=(const Changing&) = delete;

 private:
  NodeParameters& parameters_;
};

ParameterValue NodeParameters::declare(std::string_view name, Declared declared) {
  const Changing changing(*this, "declares one");
  if (has(name)) {
    throw Error(fmt::format("parameter '{}' of node '{}' is declared twice", name, node_));
  }
  check_ranges(name, declared);
  declared.value = accepted(name, declared.value, declared);
  if (const auto given = given_.find(name); given != given_.end()) {
    declared.value = accepted(name, given->second, declared);
  }
  const SetParametersResult result = ask_callbacks({{std::string(name), declared.value}});
  if (!result.successful) {
    throw Error(fmt::format("parameter '{}' of node '{}' cannot be {}: {}", name, node_,
                            to_string(declared.value), result.reason));
  }
  ParameterValue value = declared.value;
  {
    const std::lock_guard lock(mutex_);
    declared_.try_emplace(std::string(name), std::move(declared));
  }
  if (listener_) listener_({{std::string(name), value}}, true);
  return value;
}

SetParametersResult NodeParameters::set_atomically(const Parameters& values) {
  const Changing changing(*this, "sets one");
  Parameters changes;
  try {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, value] : values) {
      const Declared& declared = find(name);
      if (declared.descriptor.read_only) {
        throw Error(fmt::format("parameter '{}' of node '{}' is read-only", name, node_),
                    "give its value in the configuration");
      }
      changes.try_emplace(name, accepted(name, value, declared));
    }
  } catch (const Error& error) {
    return {false, error.what()};
  }
  if (SetParametersResult result = ask_callbacks(changes); !result.successful) return result;
  if (listener_) {
    set(Parameters(changes));
    listener_(changes, false);
  } else {
    set(std::move(changes));
  }
  return {};
}

// Swapped, so that the old values are freed after the lock. Nothing is ever undeclared.
void NodeParameters::set(Parameters values) {
  const std::lock_guard lock(mutex_);
  for (auto& [name, value] : values) std::swap(declared_.find(name)->second.value, value);
}

void NodeParameters::set_listener(ParametersListener listener) {
  const Changing changing(*this, "changes the listener");
  listener_.swap(listener);
}

SetParametersResult NodeParameters::ask_callbacks(const Parameters& values) {
  std::vector<OnSetParametersHandle> callbacks;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(callbacks_, [](const auto& callback) { return callback.expired(); });
    for (const auto& callback : callbacks_) callbacks.push_back(callback.lock());
  }
  for (auto callback = callbacks.rbegin(); callback != callbacks.rend(); ++callback) {
    if (*callback == nullptr) continue;  // dropped meanwhile
    if (SetParametersResult result = (**callback)(values); !result.successful) return result;
  }
  return {};
}

OnSetParametersHandle NodeParameters::add_callback(OnSetParametersCallback callback) {
  auto handle = std::make_shared<const OnSetParametersCallback>(std::move(callback));
  const std::lock_guard lock(mutex_);
  callbacks_.push_back(handle);
  return handle;
}

// The range must be one, and of the parameter's type.
void NodeParameters::check_ranges(std::string_view name, const Declared& declared) const {
  const auto check = [&](const auto& range, bool is_of_its_type) {
    if (!range) return;
    if (!is_of_its_type) {
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
  check(declared.descriptor.integer_range, std::holds_alternative<std::int64_t>(declared.value));
  check(declared.descriptor.floating_point_range, std::holds_alternative<double>(declared.value));
}

// The value as the parameter takes it; an Error when it does not.
ParameterValue NodeParameters::accepted(std::string_view name, const ParameterValue& given,
                                        const Declared& declared) const {
  const auto refuse = [&](const std::string& range) {
    throw Error(
        fmt::format("parameter '{}' of node '{}' cannot be {}", name, node_, to_string(given)),
        fmt::format("give {}{}", a_type(declared.value), range));
  };
  const auto& [description, read_only, integers, numbers] = declared.descriptor;
  ParameterValue value = given;
  const auto* integer = std::get_if<std::int64_t>(&given);
  if (integer != nullptr && std::holds_alternative<double>(declared.value)) {
    value = static_cast<double>(*integer);  // 2 is 2.0
  }
  const bool is_of_its_type = value.index() == declared.value.index();
  if (integers) {
    if (!is_of_its_type || !is_in(*integers, *integer)) refuse(text(*integers));
  }
  if (numbers) {
    if (!is_of_its_type || !is_in(*numbers, std::get<double>(value))) refuse(text(*numbers));
  }
  if (!is_of_its_type) refuse("");
  const IntegerRange limits{declared.limits.lowest, declared.limits.highest};
  if (std::holds_alternative<std::int64_t>(value) && !is_in(limits, *integer)) refuse(text(limits));
  return value;
}

bool NodeParameters::has(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  return declared_.contains(name);
}

ParameterValue NodeParameters::value(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  return find(name).value;
}

ParameterDescriptor NodeParameters::describe(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  return find(name).descriptor;
}

const NodeParameters::Declared& NodeParameters::find(std::string_view name) const {
  if (const auto found = declared_.find(name); found != declared_.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [declared, value] : declared_) names.push_back(declared);
  throw Error(fmt::format("node '{}' has no parameter '{}'", node_, name), suggest(name, names));
}

// ROS 2's rules: a prefix is a parameter's name, or what stands before a dot of it; the depth
// counts parts after the prefix.
ListParametersResult NodeParameters::list(const std::vector<std::string>& prefixes,
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

std::vector<std::string> NodeParameters::unused() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> result;
  for (const auto& [name, value] : given_) {
    if (!declared_.contains(name)) result.push_back(name);
  }
  return result;
}

void NodeParameters::throw_wrong_type(std::string_view name, const ParameterValue& is,
                                      const ParameterValue& wanted) const {
  throw Error(fmt::format("parameter '{}' of node '{}' is {}", name, node_, a_type(is)),
              fmt::format("it cannot be read as {}", a_type(wanted)));
}

void NodeParameters::throw_too_narrow(std::string_view name, const ParameterValue& is) const {
  throw Error(fmt::format("parameter '{}' of node '{}' is {}", name, node_, to_string(is)),
              "read it as a wider integer");
}

}  // namespace takt
