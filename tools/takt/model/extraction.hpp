// From what a run has traced to the numbers that an analysis needs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_EXTRACTION_HPP_
#define TAKT_TOOLS_TAKT_EXTRACTION_HPP_

#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/model/measured_model.hpp"

#include "run/trace.hpp"

namespace takt::tools {

/// The name in a trace of all callbacks that were let go, which no later run has.
inline const std::string kRemovedCallbacks = "(removed)";

/// The model of one system in one or several runs: the longest execution times and the closest
/// arrivals of all. Where a trace has lost executions or a queue messages, nothing is concluded
/// from what came before about what came after.
MeasuredModel extract_model(std::span<const Trace> traces);

/// The library that registers its class, also where the file names none; empty: Takt's own.
std::string library_of(const ComponentDescription& component);

/// What each component of a system is now: its class, its library, its parameters.
std::vector<MeasuredComponent> components_of(const SystemDescription& system);

/// What a trace says of the system that it is of, besides what has run: components, and settings.
nlohmann::json measured_with(const SystemDescription& system);

/// Writes what read_measured_model reads. Throws Error if the file cannot be written.
void write_measured_model(const MeasuredModel& model, const std::string& path);

nlohmann::json model_json(const MeasuredModel& model);
void print_model(const MeasuredModel& model);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_EXTRACTION_HPP_
