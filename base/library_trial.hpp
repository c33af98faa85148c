// Checks a shared library before this process loads it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LIBRARY_TRIAL_HPP_
#define TAKT_BASE_LIBRARY_TRIAL_HPP_

#include <string>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// Throws Error unless `path` is a regular file and, if it is an ELF file, has all parts that its
/// headers describe: dlopen(3) blocks at a FIFO, and a truncated library kills the process by
/// SIGBUS. Also if it is built against rclcpp. It does not check that the file exists and is an ELF
/// file, because dlopen does.
void check_library_file(const std::string& path);

/// Loads the library in a child process, because its static initialisers could throw, end their
/// process or never return. Throws Error if they do, or if it takes longer than `limit`.
///
/// The child runs the program `takt/takt_try_library` in the folder of libtakt.so, which is
/// installed together with it. If the program is missing, the trial is skipped, and one log line
/// reports it. The child lacks the symbols of this program: a library that needs them is not tried.
/// Thread safety: from any thread. Real-time: no.
void try_library(const std::string& path, Nanoseconds limit);

}  // namespace takt

#endif  // TAKT_BASE_LIBRARY_TRIAL_HPP_
