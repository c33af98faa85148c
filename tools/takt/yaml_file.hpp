// Writes configuration files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_YAML_FILE_HPP_
#define TAKT_TOOLS_TAKT_YAML_FILE_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// The document as a person would write it: what fits into a line is in one,
/// and so is a list of values. Takt reads back the
/// same values; null is none of them.
std::string yaml_file(const nlohmann::ordered_json& document);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_YAML_FILE_HPP_
