// What a process and its threads have used in the measured time. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MEASURED_USAGE_HPP_
#define TAKT_CONTAINERS_MEASURED_USAGE_HPP_

#include <cstdint>
#include <map>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/container_setting.hpp"

namespace TAKT_INTERNAL takt {

/// The measured time is from release to hold, for the process and for each of its threads.
/// Executors also spin before and after it, which must not count in their CPU shares.
/// Thread safety: one control thread. Real-time: no.
class MeasuredUsage {
 public:
  explicit MeasuredUsage(const ContainerSetting& setting);
  void begin();
  void end();
  bool has_ended() const noexcept { return end_ != TimePoint{}; }
  TimePoint begun() const noexcept { return begin_; }
  void complete(ThreadStatistics& thread) const;
  /// Adds the figures of the process and of Cyclone's threads.
  void add_to(ProcessResult& result) const;

 private:
  const ContainerSetting& setting_;
  std::vector<ThreadStatistics> dds_threads_;
  std::map<int, ThreadStatistics> counted_;  // what the kernel has counted, by thread
  TimePoint begin_{}, end_{};
  Nanoseconds cpu_time_{0};
  std::uint64_t pss_kb_ = 0;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_MEASURED_USAGE_HPP_
