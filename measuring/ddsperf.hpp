// Cyclone DDS's own measurement, to stand beside ours.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_DDSPERF_HPP_
#define TAKT_MEASURING_DDSPERF_HPP_

#include <functional>
#include <string>

namespace takt::rt {

/// Why it cannot run; empty: it can.
std::string why_no_ddsperf();

/// From here on, ddsperf started by this process stays on this machine and finds others without
/// multicast, as Takt does.
void keep_ddsperf_on_loopback();

/// Runs a shell command until it ends, with each line that it prints handed over. Throws Error when
/// it cannot be started.
void for_each_line(const std::string& command, const std::function<void(const std::string&)>& use);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_DDSPERF_HPP_
