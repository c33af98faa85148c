// The experiments of takt bench that try the claims of papers on executors.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_LITERATURE_HPP_
#define TAKT_TOOLS_TAKT_LITERATURE_HPP_

#include <vector>

#include "bench/experiments.hpp"

namespace takt::tools {

/// Each with its claims, under the real kernel and simulated.
std::vector<Experiment> literature();

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_LITERATURE_HPP_
