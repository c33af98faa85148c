// SPDX-License-Identifier: Apache-2.0
#include "yaml_file.hpp"

#include <algorithm>

#include <yaml-cpp/emitter.h>

#include "takt/containers/configuration/document.hpp"
#include "takt/measuring/json_text.hpp"

namespace takt::tools {
namespace {

using nlohmann::ordered_json;

// Limit: characters of a line that a map has in a file that Takt writes. At it: the map gets a line
// for each entry. Seen: nothing.
constexpr std::size_t kMostColumns = 100;

/// A list of values is in one line, however long.
bool is_in_line(const ordered_json& value) {
  const auto is_value = [](const ordered_json& entry) { return entry.is_primitive(); };
  return rt::json_text(value).size() <= kMostColumns ||
         (value.is_array() && std::all_of(value.begin(), value.end(), is_value));
}

/// Whether the text without quotes is read as this text, and not as a number or a boolean.
bool is_text(const std::string& text) {
  try {
    document::Errors errors("");
    const document::Value value = document::parse_yaml(text, errors);
    const auto* read = std::get_if<std::string>(&value.content);
    return read != nullptr && *read == text && value.ambiguous.empty();
  } catch (const ConfigurationError&) {
    return false;
  }
}

void write(const ordered_json& value, YAML::Emitter& yaml) {
  const auto style = is_in_line(value) ? YAML::Flow : YAML::Block;
  if (value.is_object()) {
    yaml << style << YAML::BeginMap;
    for (const auto& [name, entry] : value.items()) {
      yaml << YAML::Key << name << YAML::Value;
      write(entry, yaml);
    }
    yaml << YAML::EndMap;
  } else if (value.is_array()) {
    yaml << style << YAML::BeginSeq;
    for (const ordered_json& entry : value) write(entry, yaml);
    yaml << YAML::EndSeq;
  } else if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    if (!is_text(text)) yaml << YAML::DoubleQuoted;
    yaml << text;
  } else {
    yaml << rt::json_text(value);
  }
}

}  // namespace

std::string yaml_file(const ordered_json& document) {
  YAML::Emitter yaml;
  write(document, yaml);
  return std::string(yaml.c_str()) + "\n";
}

}  // namespace takt::tools
