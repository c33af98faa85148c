// A timeline for the viewers of Perfetto (ui.perfetto.dev) and Chrome (chrome://tracing).
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TRACE_FILE_HPP_
#define TAKT_TOOLS_TAKT_TRACE_FILE_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// Writes the "trace" of process_json in Chrome's Trace Event Format: a slice for each execution on
/// its thread, below it the time in the ready queue, an arrow from each step of a chain to the
/// next, and a mark where messages were overwritten or releases missed. Throws Error if the file
/// cannot be written.
void write_trace(const nlohmann::json& threads, const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_TRACE_FILE_HPP_
