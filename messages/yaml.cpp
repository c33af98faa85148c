// Values as YAML has them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/yaml.hpp"

#include <cmath>

#include <fmt/format.h>

namespace takt::detail {

std::string yaml_integer(std::int64_t value) {
  return fmt::format("{}", value);
}

std::string yaml_unsigned(std::uint64_t value) {
  return fmt::format("{}", value);
}

// Six digits, and always a point: the text of a float is never that of an integer.
std::string yaml_real(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  return fmt::format("{:#.6g}", value);
}

std::string yaml_text(std::string_view text) {
  std::string result = "\"";
  for (const char character : text) {
    if (character == '"' || character == '\\') result += '\\';
    result += character;
  }
  return result + '"';
}

std::string yaml_text(std::u16string_view text) {
  std::string result = "\"";
  for (const char16_t character : text) {
    if (character == u'"' || character == u'\\') result += '\\';
    if (character >= u' ' && character <= u'~') {
      result += static_cast<char>(character);
    } else {
      result += fmt::format("\\u{:04x}", static_cast<unsigned>(character));
    }
  }
  return result + '"';
}

}  // namespace takt::detail
