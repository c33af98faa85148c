// Background load for measurements.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_LOAD_HPP_
#define TAKT_MEASURING_LOAD_HPP_

#include <string>
#include <vector>

#include <sys/types.h>

namespace takt::rt {

/// Runs a load in child processes with SCHED_OTHER for as long as the object lives.
///   cpu  one process on each CPU, which computes and walks through 8 MB of memory
///   io   two processes that write, synchronise and delete a file of 4 MB in the temporary folder
///   none
class Load {
 public:
  /// Throws Error if there is no load with this name.
  explicit Load(const std::string& kind);
  ~Load();
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  std::vector<pid_t> processes_;
};

const std::vector<std::string>& load_names();

}  // namespace takt::rt

#endif  // TAKT_MEASURING_LOAD_HPP_
