// Results as JSON with the schema docs/reference/results.schema.json.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_PROCESS_JSON_HPP_
#define TAKT_MEASURING_PROCESS_JSON_HPP_

#include <cstdint>

#include <nlohmann/json.hpp>

#include "takt/containers/result.hpp"

namespace takt::rt {

/// The whole document: version, machine, runs.
nlohmann::json result_document(nlohmann::json runs);

/// The largest time in µs of each bucket of the histograms, by its number.
nlohmann::json bucket_limits_us();

/// One process as an entry of "runs", without the options of the run. Histograms are lists of
/// [bucket, count], see base/histogram.hpp.
nlohmann::json process_json(const ProcessResult& process);
/// How many releases of timers were due in a run, and how many of them its callbacks were run for.
struct Releases {
  std::uint64_t due = 0, served = 0;
};
Releases releases_of(const nlohmann::json& run);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_PROCESS_JSON_HPP_
