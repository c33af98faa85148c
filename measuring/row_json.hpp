// Rows of figures as JSON: written, read and described as their kFields say.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_ROW_JSON_HPP_
#define TAKT_MEASURING_ROW_JSON_HPP_

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/base/fields.hpp"
#include "takt/entities/entity.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt::rt {

using nlohmann::json;

template <class T>
inline constexpr bool kIsList = false;
template <class T>
inline constexpr bool kIsList<std::vector<T>> = true;
template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
/// A number that may be missing is null; what else may be missing has no key then.
template <class T>
inline constexpr bool kHasNoKey = false;
template <class T>
inline constexpr bool kHasNoKey<std::optional<T>> = !std::is_arithmetic_v<T>;
template <class T>
inline constexpr bool kIsAttributes =
    std::is_same_v<T, ThreadAttributes> || std::is_same_v<T, ThreadState>;

constexpr std::array kKinds{EntityKind::timer, EntityKind::subscription, EntityKind::service,
                            EntityKind::client, EntityKind::waitable};
constexpr std::array kPolicies{ThreadPolicy::other, ThreadPolicy::fifo, ThreadPolicy::rr,
                               ThreadPolicy::batch, ThreadPolicy::idle, ThreadPolicy::deadline};
constexpr const auto& words_of(EntityKind /*kind*/) {
  return kKinds;
}
constexpr const auto& words_of(ThreadPolicy /*policy*/) {
  return kPolicies;
}

/// Times without samples are null: 0 would look like a perfect latency.
json histogram_json(const Histogram& histogram, bool with_buckets);

template <class T>
json row_json(const T& value, bool with_buckets = true) {
  if constexpr (kIsRow<T>) {
    json row = json::object();
    const auto add = [&]<class Value>(const auto& field, const Value& of) {
      if constexpr (kHasNoKey<Value>) {
        if (!of) return;
      }
      row[field.name] = row_json(of, with_buckets);
    };
    for_each_field(add, value);
    return row;
  } else if constexpr (kIsList<T>) {
    json list = json::array();
    for (const auto& each : value) list.push_back(row_json(each, with_buckets));
    return list;
  } else if constexpr (kIsOptional<T>) {
    return value ? row_json(*value, with_buckets) : json();
  } else if constexpr (std::is_same_v<T, Histogram>) {
    return histogram_json(value, with_buckets);
  } else if constexpr (std::is_same_v<T, Nanoseconds>) {
    return us(value);
  } else if constexpr (std::is_enum_v<T>) {
    return std::string(to_string(value));
  } else if constexpr (kIsAttributes<T>) {
    json result = {{"policy", row_json(value.policy, false)},
                   {"priority", value.priority},
                   {"nice", value.nice},
                   {"affinity", value.affinity}};
    if (value.policy == ThreadPolicy::deadline) {
      result["runtime_us"] = us(value.runtime);
      result["deadline_us"] = us(value.deadline);
      result["period_us"] = us(value.period);
    }
    if constexpr (std::is_same_v<T, ThreadState>) {
      if (!value.refused.empty()) result["refused"] = value.refused;
    }
    return result;
  } else {
    return value;
  }
}

// ---- Reading ----

/// Of a time in floating-point microseconds, as the results have it: the inverse of rt::us.
Nanoseconds from_us(const json& us);

/// A place in a document.
struct Place {
  const Place* of;
  std::string_view key;
  std::size_t index = 0;  // if there is no key
  std::string text() const;
};

/// Throws Error.
[[noreturn]] void refuse(const Place& place, const json& value, std::string_view needed);
[[noreturn]] void refuse_without(const Place& place, const char* key);

template <class T>
void read_value(const json& from, T& into, const Place& place);

/// The value of the key, which must be there unless the field is newer than the file may be.
template <class T>
void read_key(const json& object, const char* key, T& into, const Place& place,
              Since since = Since::first) {
  const auto found = object.find(key);
  if (found != object.end()) return read_value(*found, into, {&place, key});
  if (since == Since::first) refuse_without(place, key);
}

void read_histogram(const json& from, Histogram& into, const Place& place);

template <class T>
void read_number(const json& from, T& into, const Place& place) {
  if constexpr (std::is_same_v<T, bool>) {
    if (!from.is_boolean()) refuse(place, from, "true or false");
  } else if constexpr (std::is_unsigned_v<T>) {
    if (!from.is_number_unsigned()) refuse(place, from, "a whole number from 0");
  } else if constexpr (std::is_integral_v<T>) {
    if (!from.is_number_integer() || !std::in_range<T>(from.get<std::int64_t>())) {
      refuse(place, from, "a whole number that is not so large");
    }
  } else {
    if (!from.is_number() || from < 0 || from > 1e15) refuse(place, from, "a number from 0");
  }
  into = from.get<T>();
}

template <class T>
void read_value(const json& from, T& into, const Place& place) {
  if constexpr (kIsRow<T>) {
    if (!from.is_object()) refuse(place, from, "an object");
    const auto read_field = [&]<Merge kHow, class Member>(const Field<kHow, Member>& field,
                                                          auto&& of) {
      if constexpr (kHow != Merge::computed) read_key(from, field.name, of, place, field.since);
    };
    for_each_field(read_field, into);
  } else if constexpr (kIsList<T>) {
    if (!from.is_array()) refuse(place, from, "a list");
    into.resize(from.size());
    for (std::size_t i = 0; i < into.size(); ++i) read_value(from[i], into[i], {&place, {}, i});
  } else if constexpr (std::is_same_v<T, std::optional<json>>) {
    into = from;
  } else if constexpr (kIsOptional<T>) {
    if (!from.is_null()) read_value(from, into.emplace(), place);
  } else if constexpr (std::is_same_v<T, Histogram>) {
    read_histogram(from, into, place);
  } else if constexpr (std::is_same_v<T, Nanoseconds>) {
    if (!from.is_number() || from < 0 || from > 9e15) refuse(place, from, "a time in µs");
    into = from_us(from);
  } else if constexpr (std::is_enum_v<T>) {
    for (const T word : words_of(into)) {
      if (from == to_string(word)) return void(into = word);
    }
    refuse(place, from, "a known word");
  } else if constexpr (kIsAttributes<T>) {
    if (!from.is_object()) refuse(place, from, "an object");
    read_key(from, "policy", into.policy, place);
    read_key(from, "priority", into.priority, place);
    read_key(from, "nice", into.nice, place);
    read_key(from, "affinity", into.affinity, place);
    read_key(from, "runtime_us", into.runtime, place, Since::later);
    read_key(from, "deadline_us", into.deadline, place, Since::later);
    read_key(from, "period_us", into.period, place, Since::later);
    if constexpr (std::is_same_v<T, ThreadState>) {
      read_key(from, "refused", into.refused, place, Since::later);
    }
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (!from.is_string()) refuse(place, from, "a text");
    into = from.get<std::string>();
  } else if constexpr (std::is_same_v<T, json>) {
    into = from;
  } else {
    read_number(from, into, place);
  }
}

// ---- The schema ----

template <class T>
nlohmann::ordered_json schema_of() {
  using Json = nlohmann::ordered_json;
  const auto reference = [](const char* name) {
    return Json{{"$ref", std::string("#/$defs/") + name}};
  };
  if constexpr (std::is_same_v<T, bool>) {
    return {{"type", "boolean"}};
  } else if constexpr (std::is_unsigned_v<T>) {
    return reference("count");
  } else if constexpr (std::is_integral_v<T>) {
    return {{"type", "integer"}};
  } else if constexpr (std::is_floating_point_v<T>) {
    return {{"type", "number"}, {"minimum", 0}};
  } else if constexpr (std::is_same_v<T, std::optional<std::uint64_t>>) {
    return reference("count_or_none");
  } else if constexpr (std::is_same_v<T, std::string>) {
    return {{"type", "string"}};
  } else if constexpr (std::is_same_v<T, Nanoseconds>) {
    return reference("us");
  } else if constexpr (std::is_same_v<T, Histogram>) {
    return reference("distribution");
  } else if constexpr (std::is_same_v<T, ThreadAttributes>) {
    return reference("asked");
  } else if constexpr (std::is_same_v<T, ThreadState>) {
    return reference("in_force");
  } else if constexpr (std::is_same_v<T, std::optional<json>>) {
    return reference("over_time");
  } else if constexpr (std::is_same_v<T, json>) {
    return {{"type", "array"}};
  } else if constexpr (kIsOptional<T>) {
    return schema_of<typename T::value_type>();
  } else if constexpr (kIsList<T>) {
    return {{"type", "array"}, {"items", schema_of<typename T::value_type>()}};
  } else if constexpr (std::is_enum_v<T>) {
    Json words = Json::array();
    for (const T word : words_of(T{})) words.push_back(std::string(to_string(word)));
    return {{"enum", std::move(words)}};
  } else {
    static_assert(kIsRow<T>);
    Json required = Json::array(), properties = Json::object();
    const auto add = [&]<class Value>(const auto& field, const Value& /*of*/) {
      Json schema = schema_of<Value>();
      if (*field.help != '\0') schema["description"] = field.help;
      properties[field.name] = std::move(schema);
      if constexpr (!kHasNoKey<Value>) required.push_back(field.name);
    };
    const auto row = std::make_unique<T>();
    for_each_field(add, std::as_const(*row));
    return {{"type", "object"},
            {"required", std::move(required)},
            {"additionalProperties", false},
            {"properties", std::move(properties)}};
  }
}

}  // namespace takt::rt

#endif  // TAKT_MEASURING_ROW_JSON_HPP_
