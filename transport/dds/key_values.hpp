// The text that endpoints and participants carry in their user data.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_KEY_VALUES_HPP_
#define TAKT_TRANSPORT_DDS_KEY_VALUES_HPP_

#include <map>
#include <string>
#include <string_view>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// Reads "typehash=RIHS01_...;node=/talker;" exactly as ROS 2 does (rmw/impl/cpp/key_value.hpp):
/// 1. An entry is a key, '=' and a value of one character or more. ';' ends it; the last needs
/// none.
/// 2. A key is letters and digits of ASCII, and nothing else.
/// 3. Of several ';' in a row the last ends the value, and the others belong to it.
/// 4. Between ';' and a key one other character is passed over. Bytes of 0 there end the text.
/// A text that breaks a rule has no entries at all: so one wrong character hides everything. Takt
/// reads by these rules too, so that what ROS 2 would not see is not seen by our tests either.
/// Thread safety: yes.
/// Real-time: allocates.
std::map<std::string, std::string> key_values(std::string_view text);

/// Whether ROS 2 reads it as the hash of a type, by the grammar of rosidl_runtime_c: "RIHS", the
/// version 01 in two hexadecimal digits, any character, then 64 hexadecimal digits of either case.
bool is_type_hash(std::string_view text) noexcept;

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_KEY_VALUES_HPP_
