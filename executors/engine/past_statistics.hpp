// Statistics of callbacks that an executor no longer has.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_PAST_STATISTICS_HPP_
#define TAKT_EXECUTORS_ENGINE_PAST_STATISTICS_HPP_

#include <cstddef>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/executors/executor.hpp"

namespace takt {
namespace TAKT_PUBLIC detail {

/// The statistics of removed callbacks, for the result of a run: for example of a lifecycle node
/// that drops its callbacks before the end. Node, group, name and kind identify a callback; one
/// that is added and removed again stays one row. After kMost rows, all others are added up in one
/// more row, `kOthers`. Thread safety: none. Real-time: no.
class PastStatistics {
 public:
  static constexpr std::size_t kMost = 256;
  static constexpr const char* kOthers = "(other removed callbacks)";

  void add(CallbackStatistics gone);
  /// The rows of the present callbacks, with their counts from before they were added again, then
  /// the rows of the removed ones.
  std::vector<CallbackStatistics> with(std::vector<CallbackStatistics> present) const;

 private:
  std::vector<CallbackStatistics> rows_;
};

/// Adds up the statistics of one thread that ran several times.
void add_to(ThreadStatistics& sum, const ThreadStatistics& more);

}  // namespace detail
}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_PAST_STATISTICS_HPP_
