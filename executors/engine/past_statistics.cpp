// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/past_statistics.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace takt::detail {
namespace {

CallbackStatistics* find(std::vector<CallbackStatistics>& rows, const CallbackStatistics& like) {
  const auto key = [](const CallbackStatistics& row) {
    return std::tie(row.node, row.group, row.callback, row.kind);
  };
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [&](const auto& known) { return key(known) == key(like); });
  return row == rows.end() ? nullptr : &*row;
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
  sum.latency.merge(more.latency);
  sum.waiting.merge(more.waiting);
  sum.take.merge(more.take);
  sum.execution.merge(more.execution);
}

}  // namespace

void PastStatistics::add(CallbackStatistics gone) {
  CallbackStatistics* row = find(rows_, gone);
  if (row == nullptr && rows_.size() >= kMost) {
    gone.node = gone.group = gone.topic = "";
    gone.callback = kOthers;
    gone.kind = EntityKind::waitable;
    row = find(rows_, gone);
  }
  if (row != nullptr) {
    add_to(*row, gone);
  } else {
    rows_.push_back(std::move(gone));
  }
}

std::vector<CallbackStatistics> PastStatistics::with(
    std::vector<CallbackStatistics> present) const {
  std::vector<CallbackStatistics> gone;
  for (const CallbackStatistics& row : rows_) {
    if (CallbackStatistics* again = find(present, row)) {
      add_to(*again, row);
    } else {
      gone.push_back(row);
    }
  }
  std::move(gone.begin(), gone.end(), std::back_inserter(present));
  return present;
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

}  // namespace takt::detail
