// SPDX-License-Identifier: Apache-2.0
#include "takt/base/printable.hpp"

#include <cstdint>
#include <optional>

#include <fmt/format.h>

namespace takt {
namespace {

struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;
};

/// The first character; nullopt: the text does not begin with valid UTF-8.
std::optional<Character> first_of(std::string_view text) {
  const auto byte = [&](std::size_t at) { return static_cast<std::uint8_t>(text[at]); };
  const std::uint8_t first = byte(0);
  if (first < 0x80) return Character{first, 1};
  const std::size_t bytes = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < bytes) return {};
  std::uint32_t code = first & (0x7fu >> bytes);
  for (std::size_t at = 1; at < bytes; ++at) {
    if ((byte(at) & 0xc0) != 0x80) return {};
    code = code << 6 | (byte(at) & 0x3fu);
  }
  const bool is_too_long = code < (bytes == 4 ? 0x10000u : bytes == 3 ? 0x800u : 0x80u);
  const bool is_surrogate = code >= 0xd800 && code <= 0xdfff;
  if (is_too_long || is_surrogate || code > 0x10ffff) return {};
  return Character{code, bytes};
}

/// Control characters, line breaks and characters that change the direction of text.
bool steers(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || (code >= 0x200e && code <= 0x200f) ||
         (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string printable(std::string_view text, Lines lines) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const auto character = first_of(text);
    const std::size_t bytes = character ? character->bytes : 1;
    const bool is_kept = lines == Lines::keep && (text[0] == '\n' || text[0] == '\t');
    if (!character) {
      result += fmt::format("\\x{:02x}", static_cast<std::uint8_t>(text[0]));
    } else if (!steers(character->code) || is_kept) {
      result += text.substr(0, bytes);
    } else if (text[0] == '\n' || text[0] == '\t' || text[0] == '\r') {
      result += text[0] == '\n' ? "\\n" : text[0] == '\t' ? "\\t" : "\\r";
    } else {
      result += fmt::format("\\u{:04x}", character->code);
    }
    text.remove_prefix(bytes);
  }
  return result;
}

}  // namespace takt
