// What callbacks have shown that an executor does not have any more.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_PAST_STATISTICS_HPP_
#define TAKT_EXECUTORS_ENGINE_PAST_STATISTICS_HPP_

#include <cstddef>
#include <vector>

#include "takt/executors/executor.hpp"

namespace takt {

/// The statistics of removed callbacks, so that a run's result has them: a lifecycle node that
/// drops its callbacks before the end, say. A callback is known by node, group, name and kind; one
/// that comes and goes again is one row. When there are kMost rows, what else goes adds up in one
/// more, called `kOthers`. Thread safety: none. Real-time: no.
class PastStatistics {
 public:
  static constexpr std::size_t kMost = 256;
  static constexpr const char* kOthers = "(other removed callbacks)";

  void add(CallbackStatistics gone);
  /// Those of the callbacks that are there, with what they have shown before they were added again,
  /// and then those that are gone.
  std::vector<CallbackStatistics> with(std::vector<CallbackStatistics> present) const;

 private:
  std::vector<CallbackStatistics> rows_;
};

/// Of one thread that runs again: what it has used adds up.
void add_to(ThreadStatistics& sum, const ThreadStatistics& more);

}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_PAST_STATISTICS_HPP_
