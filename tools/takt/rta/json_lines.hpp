// Many inputs on stdin, a line of JSON each, and an answer in a line of JSON for each.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RTA_JSON_LINES_HPP_
#define TAKT_TOOLS_TAKT_RTA_JSON_LINES_HPP_

#include <functional>
#include <string>

#include <nlohmann/json.hpp>

#include "takt/containers/configuration/document.hpp"

namespace takt::tools {

/// All of stdin, which may have no end. Throws ConfigurationError when it is too long.
std::string read_stdin(const document::Errors& errors);

/// Adds to a result, which has the line's `id`, or else its number, and its `utilisation`, if it
/// has one. Both are taken out of the value. `file`: "stdin:7".
using LineAnswer =
    std::function<void(document::Value& value, document::Errors& errors, nlohmann::json& result)>;

/// Answers each line on stdout. One that is not JSON, or for which `answer` throws a
/// ConfigurationError, is reported on stderr and ends no other; then throws Error at the end:
/// "2 of 7 lines are no `inputs`".
void answer_lines(const std::string& inputs, const LineAnswer& answer);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RTA_JSON_LINES_HPP_
