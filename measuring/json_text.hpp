// JSON as text, and text as JSON.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_JSON_TEXT_HPP_
#define TAKT_MEASURING_JSON_TEXT_HPP_

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace takt::rt {

/// In one line, or indented. `dump()` alone throws if a text of another process is no UTF-8; here
/// such bytes become U+FFFD.
template <class Json>
std::string json_text(const Json& value, int indent = -1) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// The one reader of JSON that Takt, or a program, has written; document.hpp has that of files of
/// people. Throws Error, without a place, if it is none, or nested deeper than Takt writes: what is
/// done with a document calls itself for each level.
/// Thread safety: any. Real-time: no.
nlohmann::json parse_json(std::string_view text);
/// null, where parse_json() throws.
nlohmann::json json_or_null(std::string_view text);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_JSON_TEXT_HPP_
