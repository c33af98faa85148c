// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/statistics_interval.hpp"

#include <algorithm>
#include <map>
#include <string_view>
#include <tuple>

namespace takt {
namespace {

using Interval = StatisticsInterval;

constexpr double kNsPerSecond = 1e9;

/// The rows of the earlier answer, by their key.
template <class Row, class Key>
class Earlier {
 public:
  Earlier(const std::vector<Row>& rows, Key key) : key_(key) {
    for (const Row& row : rows) rows_.emplace(key(row), &row);
  }
  /// The earlier row with the same key; an empty row if there is none.
  const Row& of(const Row& row) const {
    static const Row none;
    const auto known = rows_.find(key_(row));
    return known != rows_.end() ? *known->second : none;
  }

 private:
  Key key_;
  std::map<std::invoke_result_t<Key, const Row&>, const Row*> rows_;
};

// A counter that has decreased was reset, for example because its callback was removed and added.
std::uint64_t grown(std::uint64_t before, std::uint64_t now) noexcept {
  return now - std::min(now, before);
}

Interval::Faults faults_of(const GetStatistics::Callback& row) noexcept {
  return {row.deadline_misses, row.overruns, row.dropped};
}
Interval::ChainFaults faults_of(const GetStatistics::Chain& row) noexcept {
  return {row.misses, row.aborted};
}

template <class Row>
auto new_faults(const Row& before, const Row& now) {
  const auto then = faults_of(before);
  auto faults = faults_of(now);
  for_each_field([](const auto& /*field*/, std::uint64_t& count,
                    std::uint64_t earlier) { count = grown(earlier, count); },
                 faults, then);
  return faults;
}

class Difference {
 public:
  Difference(const GetStatistics::Response& before, const GetStatistics::Response& now)
      : before_(before), now_(now) {
    if (before.pid == now.pid && now.time_ns > before.time_ns) {
      result_.seconds =
          (static_cast<double>(now.time_ns) - static_cast<double>(before.time_ns)) / kNsPerSecond;
    }
    result_.cpu_percent = percent(before.cpu_time_ns, now.cpu_time_ns);
  }

  Interval result() && {
    threads();
    callbacks();
    executors();
    chains();
    topics();
    deviations();
    return std::move(result_);
  }

 private:
  double rate(std::uint64_t before, std::uint64_t now) const noexcept {
    return result_.seconds == 0 ? 0 : static_cast<double>(grown(before, now)) / result_.seconds;
  }
  double percent(std::int64_t before_ns, std::int64_t now_ns) const noexcept {
    if (result_.seconds == 0 || now_ns < before_ns) return 0;
    return 100 * (static_cast<double>(now_ns) - static_cast<double>(before_ns)) / kNsPerSecond /
           result_.seconds;
  }

  void threads() {
    const Earlier earlier(before_.threads, [](const auto& row) { return row.tid; });
    for (const GetStatistics::Thread& now : now_.threads) {
      const GetStatistics::Thread& before = earlier.of(now);
      result_.threads.push_back({now, percent(before.cpu_time_ns, now.cpu_time_ns),
                                 rate(before.wakeups, now.wakeups),
                                 rate(before.preemptions, now.preemptions)});
    }
  }

  void callbacks() {
    const Earlier earlier(before_.callbacks, [](const auto& row) {
      return std::tie(row.executor, row.node, row.group, row.callback, row.kind);
    });
    for (const GetStatistics::Callback& now : now_.callbacks) {
      const GetStatistics::Callback& before = earlier.of(now);
      const std::uint64_t served = now.received + now.dropped;
      result_.callbacks.push_back(
          {.executor = now.executor,
           .node = now.node,
           .group = now.group,
           .callback = now.callback,
           .kind = now.kind,
           .topic = now.topic,
           .priority = now.priority,
           .deadline = Nanoseconds(now.deadline_ns),
           .budget = Nanoseconds(now.budget_ns),
           .rate = rate(before.received, now.received),
           .latency = Interval::Times(now.latency.since(before.latency)),
           .execution = Interval::Times(now.execution.since(before.execution)),
           .faults = new_faults(before, now),
           .all_faults = faults_of(now),
           .backlog = now.topic.empty() ? 0 : grown(served, now.expected)});
    }
  }

  void executors() {
    std::map<std::string_view, std::size_t> places;
    for (const GetStatistics::Executor& now : now_.executors) {
      places.try_emplace(now.name, result_.executors.size());
      result_.executors.push_back({now});
    }
    const auto executor = [&](const std::string& name) {
      const auto found = places.find(name);
      return found != places.end() ? &result_.executors[found->second] : nullptr;
    };
    for (const Interval::Thread& thread : result_.threads) {
      Interval::Executor* const row = executor(thread.executor);
      if (row == nullptr) continue;
      ++row->threads;
      row->cpu_percent += thread.cpu_percent;
    }
    for (const Interval::Callback& callback : result_.callbacks) {
      Interval::Executor* const row = executor(callback.executor);
      if (row == nullptr) continue;
      row->rate += callback.rate;
      merge(row->faults, callback.faults);
      merge(row->all_faults, callback.all_faults);
    }
  }

  void chains() {
    const Earlier earlier(before_.chains, [](const auto& row) { return row.name; });
    for (const GetStatistics::Chain& now : now_.chains) {
      const GetStatistics::Chain& before = earlier.of(now);
      result_.chains.push_back({.name = now.name,
                                .deadline = Nanoseconds(now.deadline_ns),
                                .rate = rate(before.instances, now.instances),
                                .latency = Interval::Times(now.latency.since(before.latency)),
                                .faults = new_faults(before, now),
                                .all_faults = faults_of(now)});
    }
  }

  void topics() {
    const Earlier earlier(before_.topics, [](const auto& row) { return row.name; });
    for (const GetStatistics::Topic& now : now_.topics) {
      const GetStatistics::Topic& before = earlier.of(now);
      result_.topics.push_back(
          {now, rate(before.messages, now.messages), grown(before.dropped, now.dropped)});
    }
  }

  void deviations() {
    result_.watches_bounds = now_.watches_bounds;
    for (std::size_t i = 0; i < now_.deviations.size(); ++i) {  // deviations keep their places
      const GetStatistics::Deviation& now = now_.deviations[i];
      const bool is_known = i < before_.deviations.size();
      const std::uint64_t before = is_known ? before_.deviations[i].count : 0;
      result_.deviations.push_back({now, i, grown(before, now.count)});
    }
  }

  const GetStatistics::Response &before_, &now_;
  Interval result_;
};

}  // namespace

StatisticsInterval::Times::Times(const Histogram& part) {
  if (part.count() == 0) return;
  p50 = part.percentile(0.5);
  p99 = part.percentile(0.99);
  max = part.max();
}

StatisticsInterval interval(const GetStatistics::Response& before,
                            const GetStatistics::Response& now) {
  static const GetStatistics::Response none;
  return Difference(before.pid == now.pid ? before : none, now).result();
}

}  // namespace takt
