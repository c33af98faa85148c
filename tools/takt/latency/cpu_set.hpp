// CPU sets as cyclictest takes them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_LATENCY_CPU_SET_HPP_
#define TAKT_TOOLS_TAKT_LATENCY_CPU_SET_HPP_

#include <string>
#include <vector>

namespace takt::tools {

/// "0-3,5": these CPUs, in this order; "all": those that this process may use. Throws Error with
/// the valid ones if it is no such set, or if this process may not use one of them.
std::vector<int> parse_cpu_set(const std::string& text);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_LATENCY_CPU_SET_HPP_
