// Numbers of a stored run that no run can have.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_STORED_FAULT_HPP_
#define TAKT_TOOLS_TAKT_STORED_FAULT_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// What is wrong with a run whose fields are of the right kinds, else nothing. As counts, negative
/// numbers would be read as very large ones.
std::string stored_fault(const nlohmann::json& run);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_STORED_FAULT_HPP_
