// The nodes of a program, for `takt analyze`.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_DESCRIPTION_HPP_
#define RCLCPP_DESCRIPTION_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/nodes/node.hpp"

namespace rclcpp::detail {

/// Writes their names, groups, callbacks and the topics that they publish as JSON, for
/// tools/takt/analyze/program_nodes.cpp; without the services of their parameters. `others`: the
/// nodes that the file does not name. Throws takt::Error if it cannot be written.
void write_description(const std::vector<std::shared_ptr<takt::Node>>& nodes,
                       const std::vector<std::string>& others, const std::string& path);

}  // namespace rclcpp::detail

#endif  // RCLCPP_DESCRIPTION_HPP_
