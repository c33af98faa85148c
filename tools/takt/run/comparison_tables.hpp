// The tables of a comparison.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_COMPARISON_TABLES_HPP_
#define TAKT_TOOLS_TAKT_COMPARISON_TABLES_HPP_

#include <span>

#include "run/comparison.hpp"

namespace takt::tools {

/// For each file a table of its rows, which stand together, and one of their chains. `repeats`: so
/// many were asked for.
void print_comparison(std::span<const Comparison> rows, int repeats, bool is_simulated);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMPARISON_TABLES_HPP_
