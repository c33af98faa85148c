// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/past_statistics.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>

namespace takt::detail {
namespace {

bool is_same(const CountedCallback& a, const CountedCallback& b) {
  const auto key = [](const CountedCallback& row) {
    return std::tie(row.node, row.group, row.callback, row.kind);
  };
  return key(a) == key(b);
}
bool is_same(const ThreadStatistics& a, const ThreadStatistics& b) {
  return a.asked.name == b.asked.name;
}

void add_to(CallbackStatistics& sum, const CallbackStatistics& more) {
  sum.received += more.received;
  sum.expected += more.expected;
  sum.from_outside += more.from_outside;
  sum.dropped += more.dropped;
  sum.with_period += more.with_period;
  sum.late += more.late;
  sum.too_late += more.too_late;
  sum.deadline_misses += more.deadline_misses;
  sum.overruns += more.overruns;
  sum.skipped += more.skipped;
  sum.latency.merge(more.latency);
  sum.waiting.merge(more.waiting);
  sum.take.merge(more.take);
  sum.execution.merge(more.execution);
}

void add_to(ThreadStatistics& sum, const ThreadStatistics& more) {
  sum.counters += more.counters;
  sum.cpu_time += more.cpu_time;
  sum.wall_time += more.wall_time;
  sum.missed_periods += more.missed_periods;
  sum.dropped_outputs += more.dropped_outputs;
  sum.trace_overwritten += more.trace_overwritten;
  sum.trace.insert(sum.trace.end(), more.trace.begin(), more.trace.end());
}

/// Drops the first events of a trace.
void shorten_trace(ThreadStatistics& row, std::size_t most) {
  const std::size_t surplus = row.trace.size() - std::min(row.trace.size(), most);
  row.trace.erase(row.trace.begin(), row.trace.begin() + static_cast<std::ptrdiff_t>(surplus));
  row.trace_overwritten += surplus;
}

template <class Row, class Like>
auto find(std::vector<Row>& rows, const Like& like) {
  return std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return is_same(row, like); });
}

}  // namespace

FilledBuckets::FilledBuckets(const Histogram& histogram)
    : count_(histogram.count()),
      min_(histogram.min()),
      max_(histogram.max()),
      sum_(histogram.sum()) {
  histogram.for_each_bucket([this](std::size_t bucket, Nanoseconds, std::uint64_t count) {
    buckets_.push_back({static_cast<std::uint16_t>(bucket), static_cast<std::uint32_t>(count)});
  });
  buckets_.shrink_to_fit();
}

void FilledBuckets::add_to(Histogram& sum) const noexcept {
  if (count_ == 0) return;
  Histogram histogram;
  for (const Bucket& bucket : buckets_) histogram.add_bucket(bucket.index, bucket.count);
  histogram.set_exact(count_, min_, max_, sum_);
  sum.merge(histogram);
}

PastStatistics::Row::Row(const CallbackStatistics& of)
    : CountedCallback(of),
      latency(of.latency),
      execution(of.execution),
      waiting(of.waiting),
      take(of.take) {
}

CallbackStatistics PastStatistics::Row::statistics() const {
  CallbackStatistics result;
  static_cast<CountedCallback&>(result) = *this;
  latency.add_to(result.latency);
  execution.add_to(result.execution);
  waiting.add_to(result.waiting);
  take.add_to(result.take);
  return result;
}

void PastStatistics::add(CallbackStatistics gone) {
  if (const auto row = find(rows_, gone); row != rows_.end()) {
    add_to(gone, row->statistics());
    rows_.erase(row);
  }
  rows_.emplace_back(gone);
  if (rows_.size() <= kMost) return;
  if (!others_) others_.emplace().callback = kOthers;
  add_to(*others_, rows_.front().statistics());
  rows_.erase(rows_.begin());
}

std::vector<CallbackStatistics> PastStatistics::with(
    std::vector<CallbackStatistics> present) const {
  std::vector<CallbackStatistics> gone;
  for (const Row& row : rows_) {
    if (const auto again = find(present, row); again != present.end()) {
      add_to(*again, row.statistics());
    } else {
      gone.push_back(row.statistics());
    }
  }
  std::move(gone.begin(), gone.end(), std::back_inserter(present));
  if (others_) present.push_back(*others_);
  return present;
}

void PastThreads::add(const ThreadStatistics& gone) {
  ThreadStatistics sum = gone;
  if (const auto row = find(rows_, gone); row != rows_.end()) {
    sum = std::move(*row);
    add_to(sum, gone);
    rows_.erase(row);
  }
  shorten_trace(sum, trace_events_);
  rows_.push_back(std::move(sum));
  if (rows_.size() <= PastStatistics::kMost) return;
  if (!others_) {
    others_.emplace();
    others_->asked.name = others_->in_force.name = kOthers;
  }
  add_to(*others_, rows_.front());
  shorten_trace(*others_, 0);
  rows_.erase(rows_.begin());
}

std::vector<ThreadStatistics> PastThreads::with(std::vector<ThreadStatistics> present) const {
  for (const ThreadStatistics& row : rows_) {
    if (const auto again = find(present, row); again != present.end()) {
      add_to(*again, row);
    } else {
      present.push_back(row);
    }
  }
  if (others_) present.push_back(*others_);
  return present;
}

}  // namespace takt::detail
