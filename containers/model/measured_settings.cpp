// Settings of a file, beside its components, that may change execution times.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>
#include <string_view>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/model/coverage.hpp"
#include "takt/containers/model/measured_model.hpp"

namespace takt {
namespace {

// Execution times do not depend on the keys of these maps, or the model has them already: where and
// when callbacks run, keys for the analysis only, and keys that the digest of a component covers.
// All other keys count, also future ones, unless the table of coverage says that they do not.
constexpr std::string_view kFreeMaps[] = {
    "a callback",      "a callback group",
    "a chain",         "a client",
    "a component",     "a container",
    "a delay",         "a load policy",
    "a machine",       "a mode",
    "a node",          "a node of a program",
    "a publisher",     "a publishing overhead",
    "a restart",       "a scheduler",
    "a server",        "a subscriber",
    "a thread",        "a trigger",
    "a wait back end", "an analysis",
    "an arrival",      "an execution",
    "an executor",     "overheads",
    "the lifecycle",   "what leads to a mode",
};

bool is_free(const WrittenKey& written) {
  const CoverageEntry* const entry = coverage_of(written.map, written.key);
  return std::find(std::begin(kFreeMaps), std::end(kFreeMaps), written.map) !=
             std::end(kFreeMaps) ||
         (entry != nullptr && entry->is_free_in_run);
}

}  // namespace

std::map<std::string, std::string> measured_settings(const SystemDescription& system) {
  std::map<std::string, std::string> result;
  for (const WrittenKey& written : system.keys) {
    if (is_free(written)) continue;
    result[written.entry.empty() ? written.key : written.entry + "." + written.key] = written.value;
  }
  return result;
}

}  // namespace takt
