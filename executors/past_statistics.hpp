// Statistics of callbacks and threads that an executor no longer has.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_PAST_STATISTICS_HPP_
#define TAKT_EXECUTORS_PAST_STATISTICS_HPP_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/executors/executor.hpp"

namespace takt {
namespace TAKT_INTERNAL detail {

/// A histogram that is at rest: only its buckets that are not empty, so mostly a few hundred bytes.
class FilledBuckets {
 public:
  FilledBuckets() = default;
  explicit FilledBuckets(const Histogram& histogram);
  void add_to(Histogram& sum) const noexcept;

 private:
  struct Bucket {
    std::uint16_t index;
    std::uint32_t count;
  };
  std::vector<Bucket> buckets_;
  std::uint64_t count_ = 0;
  Nanoseconds min_{0}, max_{0}, sum_{0};
};

/// The statistics of removed callbacks, for the result of a run: for example of a lifecycle node
/// that drops its callbacks before the end. Node, group, name and kind identify a callback; one
/// that is added and removed again stays one row. The kMost callbacks that were removed last have a
/// row each, all others share one more row, `kOthers`: so the memory does not grow with the
/// components that come and go. Thread safety: none. Real-time: no.
class PastStatistics {
 public:
  // Limit: removed callbacks with a row of their own. At it: the first that was removed joins the
  // row of all others. Seen: that row, "(other removed callbacks)".
  static constexpr std::size_t kMost = 100;
  static constexpr const char* kOthers = "(other removed callbacks)";

  void add(CallbackStatistics gone);
  /// The rows of the present callbacks, with their counts from before they were added again, then
  /// the rows of the removed ones, and last that of the others.
  std::vector<CallbackStatistics> with(std::vector<CallbackStatistics> present) const;

 private:
  struct Row : CountedCallback {
    explicit Row(const CallbackStatistics& of);
    CallbackStatistics statistics() const;
    std::vector<FilledBuckets> times;
  };
  std::vector<Row> rows_;  // the last one was removed last
  std::optional<CallbackStatistics> others_;
};

/// The same for the threads of removed nodes; a thread's name identifies it. Each row has the last
/// `trace_events` executions of its trace, the row of all others none.
class PastThreads {
 public:
  static constexpr const char* kOthers = "(other removed threads)";

  explicit PastThreads(std::size_t trace_events) : trace_events_(trace_events) {}
  void add(const ThreadStatistics& gone);
  std::vector<ThreadStatistics> with(std::vector<ThreadStatistics> present) const;

 private:
  const std::size_t trace_events_;
  std::vector<ThreadStatistics> rows_;
  std::optional<ThreadStatistics> others_;
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_EXECUTORS_PAST_STATISTICS_HPP_
