// What takt latency prints: cyclictest's lines and rt-tests' JSON.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_LATENCY_OUTPUT_HPP_
#define TAKT_TOOLS_TAKT_LATENCY_OUTPUT_HPP_

#include <cstdio>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/measuring/cyclic.hpp"
#include "takt/measuring/load.hpp"
#include "takt/measuring/machine.hpp"

namespace takt::tools {

/// Each method of waking up, with its threads one after the other.
using Rows = std::vector<std::unique_ptr<rt::CyclicVariant>>;

/// What is known of the run as a whole.
struct Outcome {
  std::size_t threads = 1;  // of each method
  rt::Gaps gaps;
  rt::Observation::Result observation;
  std::vector<std::string> notes;
  std::string load;
  std::time_t start = 0, end = 0;
  int return_code = 0;
};

void print_summary(const Rows& rows, const rt::CyclicOptions& cyclic, std::FILE* file);
/// cyclictest's, of -h.
std::string histogram_text(const Rows& rows, const rt::CyclicOptions& cyclic, bool with_sum);
/// cyclictest's -v: every latency of the last round of these rows.
void print_values(const Rows& rows, std::size_t first, std::size_t count);
void print_details(const Rows& rows, const rt::CyclicOptions& cyclic, const Outcome& outcome);
nlohmann::json to_json(const Rows& rows, const rt::CyclicOptions& cyclic, const Outcome& outcome);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_LATENCY_OUTPUT_HPP_
