// The nodes of a program, for `takt analyze`.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_PROGRAMS_DESCRIPTION_HPP_
#define TAKT_PROGRAMS_DESCRIPTION_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/nodes/node.hpp"

namespace takt::programs {

/// Writes their names, groups, callbacks and the topics that they publish as JSON, for
/// tools/takt/analyze/program_nodes.cpp; without the services of their parameters. `others`: the
/// nodes that the file does not name. Throws Error if it cannot be written.
void write_description(const std::vector<std::shared_ptr<const Node>>& nodes,
                       const std::vector<std::shared_ptr<const Node>>& others,
                       const std::string& path);

}  // namespace takt::programs

#endif  // TAKT_PROGRAMS_DESCRIPTION_HPP_
