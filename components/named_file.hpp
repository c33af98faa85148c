// The file that a component's parameter names.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_NAMED_FILE_HPP_
#define TAKT_COMPONENTS_NAMED_FILE_HPP_

#include <string>

#include "takt/base/file_place.hpp"
#include "takt/nodes/node_options.hpp"

namespace TAKT_INTERNAL takt {

/// Of a node that is only constructed, no file is written: see FilePlace::as_checked_only().
/// Throws Error if a request made the node, and the owner of the container permits it no files.
FilePlace named_file(const NodeOptions& options, const std::string& path);

}  // namespace takt

#endif  // TAKT_COMPONENTS_NAMED_FILE_HPP_
