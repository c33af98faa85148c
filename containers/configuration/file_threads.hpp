// The threads of a file while it is read, and their bands of priorities.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_FILE_THREADS_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_FILE_THREADS_HPP_

#include <map>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/document.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace TAKT_INTERNAL takt {

/// A band has a thread for each of its priorities, for an executor whose callbacks preempt each
/// other. Errors are added to those of the file, with their lines.
/// Thread safety: none. Real-time: no.
class FileThreads {
 public:
  struct Entry {
    ThreadAttributes attributes;
    int line;
  };

  explicit FileThreads(document::Errors& errors) : errors_(errors) {}

  void add(const ThreadAttributes& thread, int line);
  /// The threads of a band, for add(). None if `is_sound` is false: their attributes have errors,
  /// which have been reported already.
  std::vector<ThreadAttributes> band(const ThreadAttributes& lowest, int highest, bool is_sound,
                                     int line);
  /// All threads, by name.
  const std::map<std::string, Entry>& all() const noexcept { return all_; }
  /// The attributes of this thread. If there is none, adds an error and returns default ones.
  ThreadAttributes find(const std::string& name, int line);
  /// The names that one name in the executor's list stands for.
  std::vector<std::string> of_executor(const std::string& name, const ExecutorDescription& executor,
                                       int line);
  /// Refuses other threads with a priority inside a band: they would run before some of its
  /// callbacks and after others.
  void check_bands();

 private:
  document::Errors& errors_;
  std::map<std::string, Entry> all_;
  std::map<std::string, std::vector<std::string>> bands_;  // threads, by band
  std::map<std::string, std::string> owners_;              // executors, by band
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_FILE_THREADS_HPP_
