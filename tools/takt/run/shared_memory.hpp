// The shared memory of a run.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SHARED_MEMORY_HPP_
#define TAKT_TOOLS_TAKT_SHARED_MEMORY_HPP_

#include <memory>
#include <vector>

#include "takt/containers/container.hpp"

namespace takt::tools {

/// Has RouDi run for as long as the result lives, when one of the processes requires shared memory.
/// Where none runs it is started, with as much memory as their topics of fixed size can have in use
/// at once. To know these, it makes the components once, in a process of their own that ends.
/// nullptr: not needed. Throws Error when it cannot be had.
///
/// Call it before the process has other threads.
std::unique_ptr<RoudiProcess> start_roudi(const std::vector<SystemDescription>& processes,
                                          const ContainerOverrides& overrides);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SHARED_MEMORY_HPP_
