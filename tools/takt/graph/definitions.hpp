// Definition files of messages, services and actions.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DEFINITIONS_HPP_
#define TAKT_TOOLS_TAKT_DEFINITIONS_HPP_

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/messages/type_description.hpp"

namespace takt::tools {

/// Separates the parts of .srv and .action files.
inline constexpr std::string_view kSeparator = "---";

/// The lines of the .msg, .srv or .action file of an interface like "std_msgs/msg/String", without
/// comments: of those that Takt contains, else below share/ in the folders of AMENT_PREFIX_PATH.
/// Empty if there is none. Throws Error if the definition cannot be read, or is too large.
std::optional<std::vector<std::string>> definition_lines(const std::string& type);

/// "geometry_msgs/Point[4] corners": a line that is no separator, and not empty.
struct DefinitionLine {
  /// `type` is the interface that the line is part of.
  DefinitionLine(const std::string& text, const std::string& type);
  std::string field_type, name, value;
  std::string nested;  // the full name of the field's type, if it is a message
  bool is_constant = false;
};

/// Throws Error unless the interface, with all that it refers to, is finite and of a size that can
/// be shown and sent: definitions are files of others.
void check_definition(const std::string& type);

/// The messages of an interface, and all that they refer to: of a service "X" these are "X_Request"
/// and "X_Response". Empty if there is no definition of one of them. Throws Error if a definition
/// is wrong.
std::optional<TypeDescription> defined(const std::string& type);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DEFINITIONS_HPP_
