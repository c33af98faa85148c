// What the readers of both configuration formats share: tables of keys, and typed values.
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

#include "takt/containers/configuration/document.hpp"
#include "takt/containers/configuration/reference.hpp"

namespace takt {

/// Turns a document into a SystemDescription. What is wrong becomes an error, and reading goes on.
/// It can also describe what it would read, by the same tables: then it goes through all of them
/// with values that are not there, and each reader tells what it wants instead of reading it.
/// Thread safety: none.
/// Real-time: no.
class SystemReader {
 protected:
  using Value = document::Value;
  using Read = std::function<void(const Value&)>;
  /// One key of a map: what it means, in Markdown, and what is done with its value.
  struct Field {
    std::string_view key;
    std::string_view meaning;
    Read read;
    bool is_required = false;
  };

  explicit SystemReader(document::Errors& errors) : errors_(errors) {}

  /// Reads a map in the order of the fields, not of the file: what is named comes before what
  /// names it. `whose` is what errors call the map: "a thread".
  /// Returns whether it is a map of these keys; their values are another matter.
  bool read_map(const Value& map, std::string_view whose, const std::vector<Field>& fields);
  /// Reads every value of a map with free keys, or of a list.
  Read each_in_map(Read read);
  Read each_in_list(Read read);
  /// Reads a map by the one, and what is no map by the other.
  Read either(Read no_map, Read map);

  /// Describes what this reads, instead of reading.
  std::vector<ReferenceSection> describe(const Read& root);
  bool is_describing() const noexcept { return described_ != nullptr; }
  /// While describing, tells what may stand in the present place, and returns true; it is for the
  /// readers that come to the values. Said twice of one place, it is one or the other.
  bool describes(const std::string& value, const std::string& default_value = {});

  Read into(bool& target);
  Read into(std::string& target);
  Read into(double& target);
  Read into(int& target, int lowest = std::numeric_limits<int>::min(),
            int highest = std::numeric_limits<int>::max());
  /// The same where nothing is there without the key.
  Read into(std::optional<int>& target, int lowest = std::numeric_limits<int>::min()) {
    return without_default([this, &target, lowest] { return into(target.emplace(), lowest); });
  }
  /// A text that passes this check of the target; else an error, and the target is empty.
  Read into_checked(std::string& target, std::function<void()> check);
  /// A name by the rules for nodes, namespaces and topics.
  Read into_node_name(std::string& target);
  Read into_name_space(std::string& target);
  Read into_topic(std::string& target);
  template <class T>
  using Words = std::vector<std::pair<std::string, T>>;
  /// What one of these words stands for.
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
  /// The position of the value among the words; their number, and an error, when it is none.
  std::size_t choose(const Value& value, const std::vector<std::string>& words,
                     const std::string& default_word = {});

  /// A reader that is made when there is a value, and what is there without one is not described.
  Read without_default(std::function<Read()> make);

  /// "'priority' is 'high'; write an integer".
  void refuse(const Value& value, const std::string& wanted);

  /// Adds the component, which stands in this line. No other may have its full name.
  void add(ComponentDescription component, int line);
  bool has_component(const std::string& full_name) const {
    return component_lines_.contains(full_name);
  }
  /// The full names of the components so far that the file names, in its order.
  const std::vector<std::string>& component_names() const { return component_names_; }

  document::Errors& errors_;
  SystemDescription system_;

 private:
  void describe_map(std::string_view whose, const std::vector<Field>& fields);
  // What the reader tells of a value that is not there.
  ReferenceKey described_by(const Read& read);

  std::map<std::string, int> component_lines_;  // by full name
  ReferenceKey* described_ = nullptr;           // the present place; nullptr: this is reading
  std::vector<ReferenceSection> sections_;
  std::vector<std::string> component_names_;
};

/// One component, as it stands in a configuration file, that may be given to these executors.
/// Throws Error, before anything is loaded, when the policy does not let its library in.
ComponentDescription read_component(const document::Value& component,
                                    const std::vector<std::string>& executors,
                                    const LoadPolicy& policy, document::Errors& errors);

/// The value of a parameter, of the type that it is written as; nothing, and an error, when no
/// parameter has such a value.
std::optional<ParameterValue> read_parameter(const document::Value& value,
                                             document::Errors& errors);

/// The two formats.
SystemDescription read_configuration(const document::Value& root, document::Errors& errors);
SystemDescription read_workload(const document::Value& root, document::Errors& errors);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_SYSTEM_READER_HPP_
