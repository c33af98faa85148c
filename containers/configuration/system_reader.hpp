// Base of the readers of both configuration formats: tables of keys, and typed values.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_SYSTEM_READER_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_SYSTEM_READER_HPP_

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/document.hpp"
#include "takt/containers/configuration/reference.hpp"

namespace TAKT_INTERNAL takt {

/// For tests: keys that are passed over as if nobody had written them, by the kind of map. nullptr:
/// none. See tools/check/ignored.py.
using IgnoresKey = bool (*)(std::string_view map, std::string_view key);
inline constinit IgnoresKey ignored_key = nullptr;

/// The state that the readers of one file share.
struct Reading {
  document::Errors& errors;
  SystemDescription system = {};
  std::map<std::string, int> component_lines = {};  // by full name
  /// The full names of the components read so far, in the order of the file, without components
  /// that the file does not name.
  std::vector<std::string> component_names = {};
  ReferenceKey* described = nullptr;  // the present key; nullptr: reading values
  std::vector<ReferenceSection> sections = {};
};

/// Converts a document to a SystemDescription. It collects errors and continues, so that one run
/// reports all of them. The same tables generate the reference: while describing, the reader visits
/// every table without values, and each `Read` describes the values that it accepts.
/// Thread safety: none.
/// Real-time: no.
class SystemReader {
 protected:
  using Value = document::Value;
  using Read = std::function<void(const Value&)>;
  /// One key of a map: its meaning in Markdown, and the function that reads its value.
  struct Field {
    std::string_view key;
    std::string_view meaning;
    Read read;
    bool is_required = false;
  };

  explicit SystemReader(Reading& reading)
      : errors_(reading.errors), system_(reading.system), reading_(reading) {}

  /// Reads a map in the order of `fields`, not of the file, so that names are defined before they
  /// are used. `whose` is the name of the map in errors: "a thread".
  /// Returns whether it is a map with valid keys; values may still be invalid.
  bool read_map(const Value& map, std::string_view whose, const std::vector<Field>& fields);
  /// A value of the map; nullptr: it has none, or a test ignores it.
  static const Value* find(const Value& map, std::string_view whose, std::string_view key);
  /// The same for a whole file. If it has none of these keys, errors quote nothing of the file.
  bool read_root(const Value& root, std::string_view whose, const std::vector<Field>& fields);
  /// Reads every value of a map with arbitrary keys, or of a list.
  Read each_in_map(Read read);
  Read each_in_list(Read read);
  /// Calls `chosen` for the word, and reads any other value with `otherwise`.
  Read word_or(std::string word, std::function<void()> chosen, Read otherwise);
  /// Reads a map with `map`, and any other value with `no_map`.
  Read either(Read no_map, Read map);

  /// Describes the keys of `root` instead of reading values.
  std::vector<ReferenceSection> describe(const Read& root);
  bool is_describing() const noexcept { return reading_.described != nullptr; }
  /// While describing, adds a permitted value to the present key, and returns true. Every `Read`
  /// for values calls it first, and reads nothing if it returns true.
  bool describes(const std::string& value, const std::string& default_value = {});

  Read into(bool& target);
  Read into(std::string& target);
  Read into(double& target);
  Read into(int& target, int lowest = std::numeric_limits<int>::min(),
            int highest = std::numeric_limits<int>::max());
  /// The same for a target that stays empty without the key.
  Read into(std::optional<int>& target, int lowest = std::numeric_limits<int>::min()) {
    return without_default([this, &target, lowest] { return into(target.emplace(), lowest); });
  }
  /// A text. `check` throws Error if the target is invalid; then the target is cleared.
  Read into_checked(std::string& target, std::function<void()> check);
  /// Names that follow the rules for nodes, namespaces and topics.
  Read into_node_name(std::string& target);
  Read into_name_space(std::string& target);
  Read into_topic(std::string& target);
  template <class T>
  using Words = std::vector<std::pair<std::string, T>>;
  /// One of these words; assigns its meaning to the target.
  template <class T>
  Read into(T& target, Words<T> words) {
    return [this, &target, words = std::move(words)](const Value& value) {
      std::vector<std::string> valid;
      std::string present;
      for (const auto& [word, meaning] : words) {
        valid.push_back(word);
        if (meaning == target && present.empty()) present = word;
      }
      if (const std::size_t chosen = choose(value, valid, present); chosen < words.size()) {
        target = words[chosen].second;
      }
    };
  }
  template <class T>
  Read into(std::optional<T>& target, Words<T> words) {
    return without_default([this, &target, words] { return into(target.emplace(), words); });
  }
  /// The index of the value in `words`; if it is not one of them, adds an error and returns their
  /// number.
  std::size_t choose(const Value& value, const std::vector<std::string>& words,
                     const std::string& default_word = {});

  /// Defers `make` until there is a value, and describes no default.
  Read without_default(std::function<Read()> make);

  /// Adds an error like "'priority' is 'high'; write an integer".
  void refuse(const Value& value, const std::string& wanted);

  /// Adds a component of this line; a second one with the same full name is an error.
  void add(ComponentDescription component, int line);

  document::Errors& errors_;
  SystemDescription& system_;

 private:
  void describe_map(std::string_view whose, const std::vector<Field>& fields);
  // Describes one key with its reader.
  ReferenceKey described_by(const Read& read);

  Reading& reading_;
};

/// Reads one component; `executors` are the executor names that it may use. Throws Error, before it
/// loads anything, if the policy forbids the library.
ComponentDescription read_component(const document::Value& component,
                                    const std::vector<std::string>& executors,
                                    const LoadPolicy& policy, document::Errors& errors);

/// Reads the value of a parameter; its notation gives its type. If no parameter can have this
/// value, adds an error and returns nullopt.
std::optional<ParameterValue> read_parameter(const document::Value& value,
                                             document::Errors& errors);

/// Read the two formats.
SystemDescription read_configuration(const document::Value& root, document::Errors& errors);
SystemDescription read_workload(const document::Value& root, document::Errors& errors);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_SYSTEM_READER_HPP_
