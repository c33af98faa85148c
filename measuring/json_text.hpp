// JSON as text.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_JSON_TEXT_HPP_
#define TAKT_MEASURING_JSON_TEXT_HPP_

#include <string>

namespace takt::rt {

/// In one line, or indented. `dump()` alone throws if a text of another process is no UTF-8; here
/// such bytes become U+FFFD.
template <class Json>
std::string json_text(const Json& value, int indent = -1) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace takt::rt

#endif  // TAKT_MEASURING_JSON_TEXT_HPP_
