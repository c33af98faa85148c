// Runs ddsperf, Cyclone DDS's benchmark, for comparison.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_DDSPERF_HPP_
#define TAKT_MEASURING_DDSPERF_HPP_

#include <functional>
#include <string>

namespace takt::rt {

/// Why ddsperf cannot run; empty: it can.
std::string why_no_ddsperf();

/// Configures ddsperf processes that are started from now on: loopback interface, discovery without
/// multicast, as in Takt.
void keep_ddsperf_on_loopback();

/// Runs a shell command, and passes on each line of its output. Throws Error if it cannot start.
void for_each_line(const std::string& command, const std::function<void(const std::string&)>& use);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_DDSPERF_HPP_
