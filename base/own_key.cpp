// SPDX-License-Identifier: Apache-2.0
#include "takt/base/own_key.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace takt {

bool has_key(const std::vector<OwnKey>& keys, std::string_view name) noexcept {
  return std::any_of(keys.begin(), keys.end(), [&](const OwnKey& key) { return key.name == name; });
}

void OwnValue::refuse(const std::string& what, const std::string& what_to_do) const {
  throw OwnValueError(line, fmt::format("'{}': {}", name, what), what_to_do);
}

bool OwnValue::as_bool() const {
  if (const bool* value = std::get_if<bool>(&content)) return *value;
  refuse("it is not true or false");
}

std::int64_t OwnValue::as_integer(std::int64_t least, std::int64_t most) const {
  const std::int64_t* value = std::get_if<std::int64_t>(&content);
  if (value == nullptr) refuse("it is no integer");
  if (*value < least || *value > most) {
    refuse(fmt::format("{} is not from {} to {}", *value, least, most));
  }
  return *value;
}

double OwnValue::as_number() const {
  if (const auto* value = std::get_if<std::int64_t>(&content)) return static_cast<double>(*value);
  if (const double* value = std::get_if<double>(&content)) {
    if (std::isfinite(*value)) return *value;
    refuse("it is no finite number");
  }
  refuse("it is no number");
}

const std::string& OwnValue::as_text() const {
  if (const auto* value = std::get_if<std::string>(&content)) return *value;
  refuse("it is no text");
}

Nanoseconds OwnValue::as_duration() const {
  const auto* text = std::get_if<std::string>(&content);
  if (text == nullptr) refuse("it is no duration", "write a number and its unit, such as 20ms");
  try {
    return parse_duration(*text);
  } catch (const Error& error) {
    throw OwnValueError(line, fmt::format("'{}': {}", name, error.what()), {});
  }
}

const std::vector<OwnValue>& OwnValue::as_list() const {
  if (kind == Kind::list) return values;
  refuse("it is no list");
}

const OwnValue* OwnValue::find(std::string_view key) const {
  if (kind != Kind::map) refuse("it is no map");
  return takt::find(values, key);
}

const OwnValue& OwnValue::at(std::string_view key) const {
  if (const OwnValue* value = find(key)) return *value;
  refuse(fmt::format("the key '{}' is missing", key));
}

void OwnValue::allow_only(std::initializer_list<std::string_view> keys) const {
  if (kind != Kind::map) refuse("it is no map");
  for (const OwnValue& value : values) {
    if (std::find(keys.begin(), keys.end(), value.name) != keys.end()) continue;
    value.refuse("unknown key",
                 suggest(value.name, std::vector<std::string>(keys.begin(), keys.end())));
  }
}

const OwnValue* find(const OwnValues& values, std::string_view key) {
  const auto found = std::find_if(values.begin(), values.end(),
                                  [&](const OwnValue& value) { return value.name == key; });
  return found != values.end() ? &*found : nullptr;
}

}  // namespace takt
