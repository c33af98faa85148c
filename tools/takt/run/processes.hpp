// Running a system: in this process, or in as many as it is split into.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PROCESSES_HPP_
#define TAKT_TOOLS_TAKT_PROCESSES_HPP_

#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/container.hpp"

namespace takt::tools {

/// Runs the processes of one system as one: all are made, matched with each other, and started,
/// before the first timer is released; timers stop first and what is under way is served, before
/// any ends. A single one runs in this process. EndSignals end the run cleanly, in bounded time
/// although a component's constructor runs; zero duration: only they do. A process that ends before
/// all have begun, or while they stop, is named in an Error; one that ends between is started again
/// if its description says so, and the others go on. What several write comes out with their names.
///
/// `loads`: the only process starts empty, and loads its components one by one while it runs.
///
/// Call it before the process has other threads. Returns what process_json returns, for all, and
/// under "failed" a text for each process that has ended and was not started again.
nlohmann::json run_processes(const std::vector<SystemDescription>& processes,
                             const ContainerOverrides& overrides, Nanoseconds duration,
                             bool loads = false);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PROCESSES_HPP_
