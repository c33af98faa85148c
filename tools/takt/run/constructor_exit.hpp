// Components that are constructed in the process of a command.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CONSTRUCTOR_EXIT_HPP_
#define TAKT_TOOLS_TAKT_CONSTRUCTOR_EXIT_HPP_

#include "takt/containers/container.hpp"

namespace takt::tools {

/// For a container that only a command of this process looks at: if a component's constructor calls
/// exit(), this process says so, and has failed.
ContainerOverrides reports_exit();

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CONSTRUCTOR_EXIT_HPP_
