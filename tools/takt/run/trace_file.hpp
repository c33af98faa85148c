// A timeline for the viewers of Perfetto (ui.perfetto.dev) and Chrome (chrome://tracing).
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TRACE_FILE_HPP_
#define TAKT_TOOLS_TAKT_TRACE_FILE_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// Writes what process_json has put under "trace", in Chrome's Trace Event Format: a slice for each
/// execution, on its thread; under it how long it was ready before; an arrow from each step of a
/// chain to the next; a mark where messages were overwritten or releases missed. Throws Error when
/// the file cannot be written.
void write_trace(const nlohmann::json& threads, const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_TRACE_FILE_HPP_
