// The process that runs a part of a system for its parent.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CHILD_HPP_
#define TAKT_TOOLS_TAKT_CHILD_HPP_

#include <chrono>

#include "takt/containers/container.hpp"

#include "run/end_signals.hpp"

namespace takt::tools {

/// Time after which running processes have discovered each other.
inline constexpr std::chrono::seconds kDiscoveryTime(10);

/// The main function of a child. It executes the parent's commands from the socket, until the
/// parent closes the connection or an executor fails. `guard` watches the socket already. Returns
/// the exit status.
int serve(const SystemDescription& system, ContainerOverrides overrides, int socket,
          EndGuard& guard);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CHILD_HPP_
