// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/system_reader.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/configuration/removed.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

std::string subject(const document::Value& value) {
  return value.name.empty() ? "the file" : "'" + value.name + "'";
}

std::string content_of(const document::Value& value) {
  struct Visitor {
    std::string operator()(std::monostate) const { return "empty"; }
    std::string operator()(const std::string& text) const { return "'" + text + "'"; }
    std::string operator()(const document::List&) const { return "a list"; }
    std::string operator()(const document::Map&) const { return "a map"; }
    std::string operator()(bool is_true) const { return is_true ? "true" : "false"; }
    std::string operator()(std::int64_t number) const { return fmt::format("{}", number); }
    std::string operator()(double number) const { return fmt::format("{}", number); }
  };
  return std::visit(Visitor(), value.content);
}

// The value as it is in the file, without quotes. The values of a map are recorded by their own
// keys.
std::string text_of(const document::Value& value) {
  struct Visitor {
    std::string operator()(std::monostate) const { return "null"; }
    std::string operator()(const std::string& text) const { return text; }
    std::string operator()(const document::Map&) const { return "{}"; }
    std::string operator()(const document::List& list) const {
      std::vector<std::string> texts;
      for (const document::Value& each : list) texts.push_back(text_of(each));
      return fmt::format("[{}]", fmt::join(texts, ", "));
    }
    std::string operator()(bool is_true) const { return is_true ? "true" : "false"; }
    std::string operator()(std::int64_t number) const { return fmt::format("{}", number); }
    std::string operator()(double number) const { return fmt::format("{}", number); }
  };
  return std::visit(Visitor(), value.content);
}

// A link to the section of this title.
std::string link(std::string_view title) {
  std::string anchor(title);
  std::replace(anchor.begin(), anchor.end(), ' ', '-');
  return fmt::format("[{}](#{})", title, anchor);
}

std::string code(std::string_view text) {
  return text.empty() ? std::string() : fmt::format("`{}`", text);
}

}  // namespace

// ---- Describing ----

std::vector<ReferenceSection> SystemReader::describe(const Read& root) {
  described_by(root);
  return std::move(reading_.sections);
}

bool SystemReader::describes(const std::string& value, const std::string& default_value) {
  if (!is_describing()) return false;
  reading_.described->value += (reading_.described->value.empty() ? "" : ", or ") + value;
  if (!default_value.empty()) reading_.described->default_value = default_value;
  return true;
}

ReferenceKey SystemReader::described_by(const Read& read) {
  ReferenceKey place;
  ReferenceKey* const outer = std::exchange(reading_.described, &place);
  read({});
  reading_.described = outer;
  return place;
}

void SystemReader::describe_map(std::string_view whose, const std::vector<Field>& fields) {
  describes(link(whose));
  const auto is_known = [&](const ReferenceSection& section) { return section.title == whose; };
  if (std::any_of(reading_.sections.begin(), reading_.sections.end(), is_known)) return;
  const std::size_t place = reading_.sections.size();
  reading_.sections.push_back({std::string(whose), {}});
  for (const Field& field : fields) {
    ReferenceKey key = described_by(field.read);
    key.key = field.key;
    key.meaning = field.meaning;
    key.is_required = field.is_required;
    reading_.sections[place].keys.push_back(std::move(key));
  }
}

// ---- Reading ----

void SystemReader::refuse(const Value& value, const std::string& wanted) {
  errors_.add(value.line, subject(value) + " is " + content_of(value), "write " + wanted);
}

const SystemReader::Value* SystemReader::find(const Value& map, std::string_view whose,
                                              std::string_view key) {
  const bool is_ignored = ignored_key != nullptr && ignored_key(whose, key);
  return is_ignored ? nullptr : document::find(map, key);
}

bool SystemReader::read_map(const Value& map, std::string_view whose,
                            const std::vector<Field>& fields) {
  if (is_describing()) {
    describe_map(whose, fields);
    return true;
  }
  std::vector<std::string> keys;
  for (const Field& field : fields) keys.emplace_back(field.key);
  bool fits = std::holds_alternative<document::Map>(map.content);
  each_in_map([&](const Value& value) {
    if (std::find(keys.begin(), keys.end(), value.name) != keys.end()) return;
    fits = false;
    const auto removed = std::find_if(kRemoved.begin(), kRemoved.end(), [&](const Removed& each) {
      return each.from == whose && each.name == value.name;
    });
    if (removed != kRemoved.end()) {
      errors_.add(value.line, fmt::format("'{}' was removed from {}", value.name, whose),
                  std::string(removed->instead));
    } else {
      errors_.add(value.line, fmt::format("'{}' is not a key of {}", value.name, whose),
                  suggest(value.name, keys));
    }
  })(map);
  if (!std::holds_alternative<document::Map>(map.content)) return false;
  for (const Field& field : fields) {
    if (const Value* value = find(map, whose, field.key)) {
      system_.keys.push_back({std::string(whose), map.name, std::string(field.key),
                              errors_.where(value->line), text_of(*value)});
      field.read(*value);
    } else if (field.is_required) {
      errors_.add(map.line, fmt::format("{} needs the key '{}'", whose, field.key), "add it");
      fits = false;
    }
  }
  return fits;
}

bool SystemReader::read_root(const Value& root, std::string_view whose,
                             const std::vector<Field>& fields) {
  if (!is_describing()) {
    std::vector<std::string> keys;
    for (const Field& field : fields) keys.emplace_back(field.key);
    document::check_is_ours(root, keys, errors_);
  }
  return read_map(root, whose, fields);
}

SystemReader::Read SystemReader::each_in_map(Read read) {
  return [this, read = std::move(read)](const Value& map) {
    if (is_describing()) {
      describes("map, each " + described_by(read).value);
      return;
    }
    const auto* content = std::get_if<document::Map>(&map.content);
    if (content == nullptr) return refuse(map, "a map");
    for (const Value& value : content->values) read(value);
  };
}

SystemReader::Read SystemReader::each_in_list(Read read) {
  return [this, read = std::move(read)](const Value& list) {
    if (is_describing()) {
      describes("list, each " + described_by(read).value);
      return;
    }
    const auto* content = std::get_if<document::List>(&list.content);
    if (content == nullptr) return refuse(list, "a list");
    for (const Value& value : *content) read(value);
  };
}

SystemReader::Read SystemReader::word_or(std::string word, std::function<void()> chosen,
                                         Read otherwise) {
  return [this, word = std::move(word), chosen = std::move(chosen),
          otherwise = std::move(otherwise)](const Value& value) {
    const auto* text = std::get_if<std::string>(&value.content);
    if (text != nullptr && *text == word) return chosen();
    describes(fmt::format("`{}`", word));
    otherwise(value);
  };
}

SystemReader::Read SystemReader::either(Read no_map, Read map) {
  return [this, no_map = std::move(no_map), map = std::move(map)](const Value& value) {
    const bool is_map = std::holds_alternative<document::Map>(value.content);
    if (!is_map || is_describing()) no_map(value);
    if (is_map || is_describing()) map(value);
  };
}

SystemReader::Read SystemReader::into(bool& target) {
  return [this, &target](const Value& value) {
    if (describes("`true` or `false`", target ? "`true`" : "`false`")) return;
    const bool* content = std::get_if<bool>(&value.content);
    if (content == nullptr) return refuse(value, "true or false");
    target = *content;
  };
}

SystemReader::Read SystemReader::into(std::string& target) {
  return [this, &target](const Value& value) {
    if (describes("text", code(target))) return;
    const auto* content = std::get_if<std::string>(&value.content);
    if (content == nullptr) return refuse(value, "a text, in quotes if it looks like a number");
    if (content->empty()) return refuse(value, "a text that is not empty");
    target = *content;
  };
}

SystemReader::Read SystemReader::into(double& target) {
  return [this, &target](const Value& value) {
    if (describes("number", fmt::format("{}", target))) return;
    if (const auto* integer = std::get_if<std::int64_t>(&value.content)) {
      target = static_cast<double>(*integer);
    } else if (const auto* number = std::get_if<double>(&value.content)) {
      target = *number;
    } else {
      refuse(value, "a number");
    }
  };
}

SystemReader::Read SystemReader::into(int& target, int lowest, int highest) {
  return [this, &target, lowest, highest](const Value& value) {
    using Limits = std::numeric_limits<int>;
    const std::string range = lowest == Limits::min() ? ""
                              : highest == Limits::max()
                                  ? fmt::format(" from {}", lowest)
                                  : fmt::format(", {} to {}", lowest, highest);
    if (describes("integer" + range, fmt::format("{}", target))) return;
    const auto* content = std::get_if<std::int64_t>(&value.content);
    if (content == nullptr) return refuse(value, "an integer");
    if (*content < lowest || *content > highest) {
      return refuse(value, fmt::format("an integer from {} to {}", lowest, highest));
    }
    target = static_cast<int>(*content);
  };
}

SystemReader::Read SystemReader::without_default(std::function<Read()> make) {
  return [this, make = std::move(make)](const Value& value) {
    make()(value);
    if (is_describing()) reading_.described->default_value.clear();
  };
}

std::size_t SystemReader::choose(const Value& value, const std::vector<std::string>& words,
                                 const std::string& default_word) {
  if (describes(fmt::format("`{}`", fmt::join(words, "`, `")), code(default_word))) {
    return words.size();
  }
  const auto* content = std::get_if<std::string>(&value.content);
  if (content == nullptr) {
    refuse(value, fmt::format("one of {}", fmt::join(words, ", ")));
    return words.size();
  }
  const auto found = std::find(words.begin(), words.end(), *content);
  if (found == words.end()) {
    errors_.add(value.line, fmt::format("{} cannot be '{}'", subject(value), *content),
                suggest(*content, words));
  }
  return static_cast<std::size_t>(found - words.begin());
}

SystemReader::Read SystemReader::into_checked(std::string& target, std::function<void()> check) {
  return [this, &target, check = std::move(check)](const Value& value) {
    into(target)(value);
    if (is_describing()) return;
    if (!target.empty() && !errors_.passes(value.line, check)) target.clear();
  };
}

// Node implements the rules for names; constructing one has no side effects.

SystemReader::Read SystemReader::into_node_name(std::string& target) {
  return into_checked(target, [&target] { check_node_name(target); });
}

SystemReader::Read SystemReader::into_name_space(std::string& target) {
  return into_checked(target, [&target] { const Node node("any", {.name_space = target}); });
}

SystemReader::Read SystemReader::into_topic(std::string& target) {
  return into_checked(target, [&target] { Node("any").resolve(target); });
}

void SystemReader::add(ComponentDescription component, int line) {
  if (!component.name.empty()) {
    const std::string name = full_name(component);
    const auto [first, is_new] = reading_.component_lines.try_emplace(name, line);
    if (is_new) {
      reading_.component_names.push_back(name);
    } else {
      errors_.add(line, fmt::format("the name '{}' is taken in line {}", name, first->second),
                  "give each component its own name or namespace");
    }
  }
  system_.components.push_back(std::move(component));
}

}  // namespace takt
