// What the readers of both configuration formats share: tables of keys, and typed values.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SYSTEM_READER_HPP_
#define TAKT_CONTAINERS_SYSTEM_READER_HPP_

#include <functional>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/containers/document.hpp"

namespace takt {

/// Turns a document into a SystemDescription. What is wrong becomes an error, and reading goes on.
/// Thread safety: none.
/// Real-time: no.
class SystemReader {
 protected:
  using Value = document::Value;
  using Read = std::function<void(const Value&)>;
  /// One key of a map, and what is done with its value.
  struct Field {
    std::string_view key;
    Read read;
    bool is_required = false;
  };

  explicit SystemReader(document::Errors& errors) : errors_(errors) {}

  /// Reads a map in the order of the fields, not of the file: what is named comes before what
  /// names it. `whose` is what errors call the map: "a thread".
  void read_map(const Value& map, std::string_view whose, const std::vector<Field>& fields);
  /// Reads every value of a map with free keys, or of a list.
  Read each_in_map(Read read);
  Read each_in_list(Read read);

  Read into(bool& target);
  Read into(std::string& target);
  Read into(double& target);
  Read into(int& target, int lowest = std::numeric_limits<int>::min(),
            int highest = std::numeric_limits<int>::max());
  /// A text that passes this check of the target; else an error, and the target is empty.
  Read into_checked(std::string& target, std::function<void()> check);
  /// A name by the rules for nodes, namespaces and topics.
  Read into_node_name(std::string& target);
  Read into_name_space(std::string& target);
  Read into_topic(std::string& target);
  /// What one of these words stands for.
  template <class T>
  Read into(T& target, std::vector<std::pair<std::string, T>> words) {
    return [this, &target, words = std::move(words)](const Value& value) {
      std::vector<std::string> valid;
      for (const auto& [word, meaning] : words) valid.push_back(word);
      if (const std::size_t chosen = choose(value, valid); chosen < words.size()) {
        target = words[chosen].second;
      }
    };
  }
  /// The position of the value among the words; their number, and an error, when it is none.
  std::size_t choose(const Value& value, const std::vector<std::string>& words);

  /// "'priority' is 'high'; write an integer".
  void refuse(const Value& value, const std::string& wanted);

  /// Adds the component, which stands in this line. No other may have its full name.
  void add(ComponentDescription component, int line);

  document::Errors& errors_;
  SystemDescription system_;

 private:
  std::map<std::string, int> component_lines_;  // by full name
};

/// The two formats.
SystemDescription read_configuration(const document::Value& root, document::Errors& errors);
SystemDescription read_workload(const document::Value& root, document::Errors& errors);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SYSTEM_READER_HPP_
