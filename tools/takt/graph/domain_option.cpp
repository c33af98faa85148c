// SPDX-License-Identifier: Apache-2.0
#include "graph/domain_option.hpp"

#include <CLI/CLI.hpp>

namespace takt::tools {

void DomainOption::add_to(CLI::App& command) {
  command.add_option("--domain", given_, "The DDS domain (default: ROS_DOMAIN_ID, else 0)");
}

}  // namespace takt::tools
