// The CPUs that this process may use.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_AVAILABLE_CPUS_HPP_
#define TAKT_BASE_AVAILABLE_CPUS_HPP_

#include <vector>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// The CPUs that this process was given when it started, in order.
/// Thread safety: from any thread. Real-time: set-up only.
const std::vector<int>& available_cpus();

/// Those, and all others to which a thread of this process may be moved, in order: isolated CPUs
/// (isolcpus) are in no mask that a process is started with, nor is what `taskset` leaves out.
/// Asked by trying, with a short thread that visits them, as the files of cgroups differ. Thread
/// safety: from any thread. Real-time: set-up only; the first call takes a few milliseconds.
const std::vector<int>& usable_cpus();

/// Lets the calling thread run on all of them. Returns false, and sets errno, if the kernel
/// refuses. Thread safety: from any thread. Real-time: set-up only.
bool use_available_cpus();

}  // namespace takt

#endif  // TAKT_BASE_AVAILABLE_CPUS_HPP_
