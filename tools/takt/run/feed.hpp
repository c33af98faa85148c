// Runs another program with a text as its input.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_FEED_HPP_
#define TAKT_TOOLS_TAKT_FEED_HPP_

#include <string>
#include <vector>

namespace takt::tools {

/// The exit status of a program that is not installed.
inline constexpr int kNotInstalled = 127;

/// Finds the program by $PATH, waits for its end, and returns its exit status; 1 if a signal ended
/// it. It may end before it has read all.
int feed(std::vector<std::string> command, const std::string& input);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_FEED_HPP_
