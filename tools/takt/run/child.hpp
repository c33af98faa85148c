// The process that runs a part of a system for its parent.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CHILD_HPP_
#define TAKT_TOOLS_TAKT_CHILD_HPP_

#include <chrono>

#include "takt/containers/container.hpp"

namespace takt::tools {

/// Then processes that run have found each other.
inline constexpr std::chrono::seconds kDiscoveryTime(10);

/// The child's whole life. It does what the parent says by the socket, and ends when the parent is
/// gone, or when one of its executors has failed. Returns its exit status.
int serve(const SystemDescription& system, ContainerOverrides overrides, int socket);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CHILD_HPP_
