// What is found out about a shared library before this process loads it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LIBRARY_TRIAL_HPP_
#define TAKT_BASE_LIBRARY_TRIAL_HPP_

#include <string>

#include "takt/base/time.hpp"

namespace takt {

/// dlopen(3) blocks at a FIFO, and a library that is cut off ends its process by SIGBUS. Throws
/// Error unless `path` is a regular file and, if it is an ELF file, has all parts that its headers
/// promise. Says nothing of a file that does not exist or is no ELF file: dlopen does.
void check_library_file(const std::string& path);

/// Loads the library in a process of its own, as its static initialisers could throw, end their
/// process or never return. Throws Error when they do, or when it takes longer than `limit`.
///
/// The process runs the program `takt/takt_try_library` in the folder of libtakt.so, which is a
/// part of the library's installation, so that every program that links libtakt has it. Without it
/// the library is loaded untried, and one line of the log says so. The process lacks the symbols of
/// this program: a library that needs those cannot be tried, and is not refused for it.
/// Thread safety: from any thread. Real-time: no.
void try_library(const std::string& path, Nanoseconds limit);

}  // namespace takt

#endif  // TAKT_BASE_LIBRARY_TRIAL_HPP_
