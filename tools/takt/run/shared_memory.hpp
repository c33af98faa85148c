// Provides shared memory for a run.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SHARED_MEMORY_HPP_
#define TAKT_TOOLS_TAKT_SHARED_MEMORY_HPP_

#include <memory>
#include <vector>

#include "takt/containers/container.hpp"

namespace takt::tools {

/// If a process requires shared memory and no RouDi runs, starts RouDi for as long as the returned
/// object lives. It gets as much memory as the topics of fixed size can use at once; to find these
/// topics, constructs the components once in a child process. Returns nullptr if no process
/// requires shared memory. Throws Error if it is not available.
///
/// Call it before the process has other threads.
std::unique_ptr<RoudiProcess> start_roudi(const std::vector<SystemDescription>& processes,
                                          const ContainerOverrides& overrides);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SHARED_MEMORY_HPP_
