// Runs ddsperf, Cyclone DDS's benchmark, for comparison.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_DDSPERF_HPP_
#define TAKT_MEASURING_DDSPERF_HPP_

#include <functional>
#include <string>

namespace takt::rt {

/// Why ddsperf cannot run; empty: it can.
std::string why_no_ddsperf();

/// Configures the ddsperf that this process becomes: loopback interface, discovery without
/// multicast, as in Takt. Takt's own domains would read it, too.
void keep_ddsperf_on_loopback();

/// Runs a shell command with ddsperf, configured the same, and passes on each line of its output.
/// When `end` can be read, or this process has died, the command is killed. Throws Error if it
/// cannot start.
void for_each_line(const std::string& command, const std::function<void(const std::string&)>& use,
                   int end = -1);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_DDSPERF_HPP_
