// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/system_reader.hpp"

#include <algorithm>

#include "takt/entities/node.hpp"

namespace takt {
namespace {

// Keys of the design that come later. They are no mistakes, so they deserve their own words.
bool is_planned(std::string_view key) {
  static constexpr std::string_view kPlanned[] = {
      "budget",  "chains", "criticality", "dds",        "library",    "lifecycle", "on_exception",
      "overrun", "per",    "restart",     "schedulers", "statistics", "wait"};
  return std::find(std::begin(kPlanned), std::end(kPlanned), key) != std::end(kPlanned);
}

std::string subject(const document::Value& value) {
  return value.name.empty() ? "the file" : "'" + value.name + "'";
}

std::string describe(const document::Value& value) {
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

}  // namespace

void SystemReader::refuse(const Value& value, const std::string& wanted) {
  errors_.add(value.line, subject(value) + " is " + describe(value), "write " + wanted);
}

void SystemReader::read_map(const Value& map, std::string_view whose,
                            const std::vector<Field>& fields) {
  std::vector<std::string> keys;
  for (const Field& field : fields) keys.emplace_back(field.key);
  each_in_map([&](const Value& value) {
    if (std::find(keys.begin(), keys.end(), value.name) != keys.end()) return;
    if (is_planned(value.name)) {
      errors_.add(value.line, fmt::format("'{}' is not built yet", value.name), "leave it out");
    } else {
      errors_.add(value.line, fmt::format("'{}' is no key of {}", value.name, whose),
                  suggest(value.name, keys));
    }
  })(map);
  if (!std::holds_alternative<document::Map>(map.content)) return;
  for (const Field& field : fields) {
    if (const Value* value = document::find(map, field.key)) {
      field.read(*value);
    } else if (field.is_required) {
      errors_.add(map.line, fmt::format("{} needs the key '{}'", whose, field.key), "add it");
    }
  }
}

SystemReader::Read SystemReader::each_in_map(Read read) {
  return [this, read = std::move(read)](const Value& map) {
    const auto* content = std::get_if<document::Map>(&map.content);
    if (content == nullptr) return refuse(map, "a map");
    for (const Value& value : content->values) read(value);
  };
}

SystemReader::Read SystemReader::each_in_list(Read read) {
  return [this, read = std::move(read)](const Value& list) {
    const auto* content = std::get_if<document::List>(&list.content);
    if (content == nullptr) return refuse(list, "a list");
    for (const Value& value : *content) read(value);
  };
}

SystemReader::Read SystemReader::into(bool& target) {
  return [this, &target](const Value& value) {
    const bool* content = std::get_if<bool>(&value.content);
    if (content == nullptr) return refuse(value, "true or false");
    target = *content;
  };
}

SystemReader::Read SystemReader::into(std::string& target) {
  return [this, &target](const Value& value) {
    const auto* content = std::get_if<std::string>(&value.content);
    if (content == nullptr) return refuse(value, "a text, in quotes if it looks like a number");
    if (content->empty()) return refuse(value, "a text that is not empty");
    target = *content;
  };
}

SystemReader::Read SystemReader::into(double& target) {
  return [this, &target](const Value& value) {
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
    const auto* content = std::get_if<std::int64_t>(&value.content);
    if (content == nullptr) return refuse(value, "an integer");
    if (*content < lowest || *content > highest) {
      return refuse(value, fmt::format("an integer from {} to {}", lowest, highest));
    }
    target = static_cast<int>(*content);
  };
}

std::size_t SystemReader::choose(const Value& value, const std::vector<std::string>& words) {
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
    if (!target.empty() && !errors_.passes(value.line, check)) target.clear();
  };
}

// A node knows the rules for names, and a bare one does nothing.

SystemReader::Read SystemReader::into_node_name(std::string& target) {
  return into_checked(target, [&target] { const Node node(target); });
}

SystemReader::Read SystemReader::into_name_space(std::string& target) {
  return into_checked(target, [&target] { const Node node("any", {.name_space = target}); });
}

SystemReader::Read SystemReader::into_topic(std::string& target) {
  return into_checked(target, [&target] { Node("any").resolve(target); });
}

void SystemReader::add(ComponentDescription component, int line) {
  if (!component.name.empty()) {
    const std::string name =
        Node(component.name, {.name_space = component.name_space}).fully_qualified_name();
    const auto [first, is_new] = component_lines_.try_emplace(name, line);
    if (!is_new) {
      errors_.add(line, fmt::format("the name '{}' is taken in line {}", name, first->second),
                  "give each component its own name or namespace");
    }
  }
  system_.components.push_back(std::move(component));
}

}  // namespace takt
