// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/json_text.hpp"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt::rt {
namespace {

// Limit: levels of JSON that Takt or a program has written. At it: it is refused. Seen: the error.
constexpr std::size_t kMostLevels = 64;

std::size_t levels_of(std::string_view text) {
  std::size_t level = 0, most = 0;
  bool is_in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_in_text) {
      if (c == '\\') ++i;
      is_in_text = c != '"';
    } else if (c == '"') {
      is_in_text = true;
    } else if (c == '[' || c == '{') {
      most = std::max(most, ++level);
    } else if ((c == ']' || c == '}') && level > 0) {
      --level;
    }
  }
  return most;
}

}  // namespace

nlohmann::json parse_json(std::string_view text) {
  if (levels_of(text) > kMostLevels) {
    throw Error(fmt::format("it is nested deeper than {} levels", kMostLevels));
  }
  nlohmann::json document = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (document.is_discarded()) throw Error("it is no JSON");
  return document;
}

nlohmann::json json_or_null(std::string_view text) {
  try {
    return parse_json(text);
  } catch (const Error&) {
    return {};
  }
}

}  // namespace takt::rt
