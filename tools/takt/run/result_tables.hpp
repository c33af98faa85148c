// The tables of a run on a terminal.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_TABLES_HPP_
#define TAKT_TOOLS_TAKT_RESULT_TABLES_HPP_

#include "takt/measuring/run.hpp"

namespace takt::tools {

/// Prints callbacks, chains, topics between processes, threads and processes of a run in results.
void print_result(const rt::Run& run);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_TABLES_HPP_
