// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/past_statistics.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <type_traits>

#include "takt/executors/figures.hpp"

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

template <class Statistics, class Visit>
void for_each_time(Statistics& of, const Visit& visit) {
  const auto visit_time = [&visit](const auto& /*field*/, auto&& value) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, Histogram>) visit(value);
  };
  for_each_field(visit_time, of);
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

PastStatistics::Row::Row(const CallbackStatistics& of) : CountedCallback(of) {
  for_each_time(of, [this](const Histogram& histogram) { times.emplace_back(histogram); });
}

CallbackStatistics PastStatistics::Row::statistics() const {
  CallbackStatistics result;
  static_cast<CountedCallback&>(result) = *this;
  auto next = times.begin();
  for_each_time(result, [&](Histogram& histogram) { (next++)->add_to(histogram); });
  return result;
}

void PastStatistics::add(CallbackStatistics gone) {
  if (const auto row = find(rows_, gone); row != rows_.end()) {
    merge(gone, row->statistics());
    rows_.erase(row);
  }
  rows_.emplace_back(gone);
  if (rows_.size() <= kMost) return;
  if (!others_) others_.emplace().callback = kOthers;
  merge(*others_, rows_.front().statistics());
  rows_.erase(rows_.begin());
}

std::vector<CallbackStatistics> PastStatistics::with(
    std::vector<CallbackStatistics> present) const {
  std::vector<CallbackStatistics> gone;
  for (const Row& row : rows_) {
    if (const auto again = find(present, row); again != present.end()) {
      merge(*again, row.statistics());
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
    merge(sum, gone);
    rows_.erase(row);
  }
  shorten_trace(sum, trace_events_);
  rows_.push_back(std::move(sum));
  if (rows_.size() <= PastStatistics::kMost) return;
  if (!others_) {
    others_.emplace();
    others_->asked.name = others_->in_force.name = kOthers;
  }
  merge(*others_, rows_.front());
  shorten_trace(*others_, 0);
  rows_.erase(rows_.begin());
}

std::vector<ThreadStatistics> PastThreads::with(std::vector<ThreadStatistics> present) const {
  for (const ThreadStatistics& row : rows_) {
    if (const auto again = find(present, row); again != present.end()) {
      merge(*again, row);
    } else {
      present.push_back(row);
    }
  }
  if (others_) present.push_back(*others_);
  return present;
}

}  // namespace takt::detail
