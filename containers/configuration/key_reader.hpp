// Base of the readers of the configuration file's keys.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_KEY_READER_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_KEY_READER_HPP_

#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "takt/containers/configuration/file_threads.hpp"
#include "takt/containers/configuration/system_reader.hpp"

namespace takt {

/// The state that the readers of a configuration file share.
struct ConfigurationReading : Reading {
  explicit ConfigurationReading(document::Errors& of_file) : Reading{of_file} {}

  const LoadPolicy* policy = nullptr;  // applies to requests; nullptr: a file may load anything
  /// The file has `machine: cpus`: threads are checked against these, not against this machine's.
  bool names_cpus = false;
  FileThreads threads{errors};
  std::set<std::string> executors{"default"};  // exists in every system
  std::set<std::string> broken;  // schedulers and wait back ends whose errors were reported
};

/// Functions for readers of several keys. A reader lives as long as its key is read.
/// Thread safety: none. Real-time: no.
class KeyReader : protected SystemReader {
 public:
  explicit KeyReader(ConfigurationReading& file) : SystemReader(file), file_(file) {}

 protected:
  /// Clears `is_sound` if reading adds an error.
  Read noting(bool& is_sound, Read read);
  /// `check` throws Error if the duration is invalid.
  Read into_duration(Nanoseconds& duration, std::function<void()> check);
  /// The same for a duration that stays empty without the key.
  Read into_duration(
      std::optional<Nanoseconds>& duration, std::function<void()> check = [] {});
  Read into_accepted(Acceptances& accepted);
  Read into_executor(std::string& target);
  void read_library(const Value& value, std::string& library);
  /// Paths in the file are relative to the file's folder.
  std::string beside(const std::string& path) const;
  /// Reports an error in the line of the key, or of the map if the key is missing.
  bool passes(const Value& map, std::string_view key, const std::function<void()>& check);
  /// Refuses an empty list of CPUs: only a missing key means all CPUs.
  void check_is_some(const Value& list);

  ConfigurationReading& file_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_KEY_READER_HPP_
