// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/key_values.hpp"

#include <utility>

namespace takt {
namespace {

bool is_of_a_key(char character) noexcept {
  return (character >= '0' && character <= '9') || (character >= 'a' && character <= 'z') ||
         (character >= 'A' && character <= 'Z');
}

}  // namespace

std::map<std::string, std::string> key_values(std::string_view text) {
  std::map<std::string, std::string> entries;
  std::string key, value;
  bool in_value = false;
  char previous = '\0';
  for (const char character : text) {
    if (in_value) {
      const bool ends_value = character != ';' && previous == ';';
      if (!ends_value) {
        if (character != ';' || previous == ';') value += character;
        previous = character;
        continue;
      }
      if (value.empty()) return {};
      entries[std::exchange(key, {})] = std::exchange(value, {});
      in_value = false;
    }
    if (character == '=') {
      if (key.empty()) return {};
      in_value = true;
    } else if (is_of_a_key(character)) {
      key += character;
    } else if (character == '\0' && key.empty() && !entries.empty()) {
      break;
    } else if (previous != ';' || !key.empty()) {
      return {};
    }
    previous = character;
  }
  if (in_value ? value.empty() : !key.empty()) return {};
  if (in_value) entries[key] = value;
  return entries;
}

bool is_type_hash(std::string_view text) noexcept {
  constexpr std::string_view kPrefix = "RIHS01";
  constexpr std::size_t kDigits = 64;
  return text.size() == kPrefix.size() + 1 + kDigits && text.starts_with(kPrefix) &&
         text.substr(kPrefix.size() + 1).find_first_not_of("0123456789abcdefABCDEF") == text.npos;
}

}  // namespace takt
