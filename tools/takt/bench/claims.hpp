// Whether what a paper says holds here.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CLAIMS_HPP_
#define TAKT_TOOLS_TAKT_CLAIMS_HPP_

#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "bench/experiments.hpp"

namespace takt::tools {

/// What a variant has measured in all its runs, in their order.
using ValuesOf =
    std::function<std::vector<double>(const Variant& variant, const std::string& metric)>;

/// Each claim at each x, under the real kernel and simulated: {text, metric, less, more, x,
/// simulated, ratio, low, high, repeats, verdict}. The ratio is less ÷ more, and missing where one
/// of them is 0. The verdict is `holds` if its 95 % interval lies below 1, `refuted` if above, else
/// `open`, also of fewer than six runs. A claim about one series holds if it is 0 in each run.
nlohmann::json try_claims(const Experiment& experiment, const std::vector<Variant>& variants,
                          const ValuesOf& values_of);

void print_claims(const nlohmann::json& claims);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CLAIMS_HPP_
