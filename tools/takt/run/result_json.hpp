// Files of results: writing them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
#define TAKT_TOOLS_TAKT_RESULT_JSON_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// Writes the document to the file, as OutputFile does, or to stdout for "-".
void write_json(const nlohmann::json& document, const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
