// What a child process writes into a pipe until it ends.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CHILD_OUTPUT_HPP_
#define TAKT_TOOLS_TAKT_CHILD_OUTPUT_HPP_

#include <string>

#include <sys/types.h>

#include "takt/base/time.hpp"

namespace takt::tools {

/// The end of a pipe is not the end of the child: processes that it has started, as drivers do, may
/// hold the pipe for ever.
/// Thread safety: none. Real-time: no.
class ChildOutput {
 public:
  /// Of a child that nobody waits for meanwhile. Closes the pipe in the end.
  ChildOutput(pid_t child, int pipe);
  ~ChildOutput();
  ChildOutput(const ChildOutput&) = delete;
  ChildOutput& operator=(const ChildOutput&) = delete;

  /// Waits for output, for the child's end, or until `other` is readable (-1: none), at most so
  /// long. Returns false when the child has ended, and all that it has said is in text().
  bool wait(Nanoseconds most, int other = -1);
  const std::string& text() const noexcept { return text_; }

 private:
  bool read_some();
  const int pipe_, process_;
  std::string text_;
};

/// For pipes whose writer has ended: how much may be in it at most.
std::size_t most_in(int pipe) noexcept;

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CHILD_OUTPUT_HPP_
