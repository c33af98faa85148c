// What the rows of a comparison ran on.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SETUP_HPP_
#define TAKT_TOOLS_TAKT_SETUP_HPP_

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "takt/measuring/run.hpp"

namespace takt::tools {

/// Of all executors of components in a run: their threads, and what was in force.
struct Setup {
  std::size_t threads = 0;
  std::size_t unused = 0;  // threads of the file that an executor's type cannot use
  std::string priorities, cpus, schedulers;

  /// "2", or "1/2" where a type cannot use all.
  std::string threads_text() const;
};

/// Of a run in results. Those of an earlier Takt do not tell: all is empty.
Setup setup_of(const rt::Run& run);

/// "threads 10 against 2, CPUs 0 against 0,1": what differs besides the executor's type, and its
/// own scheduler. Empty: nothing, or one of them is not known.
std::string difference(const Setup& setup, const Setup& other);

/// For each thing that differs between the rows, by name: "threads: 2 (events, triggered), 10
/// (isolated)".
std::vector<std::string> differences(std::span<const std::pair<std::string, Setup>> rows);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SETUP_HPP_
