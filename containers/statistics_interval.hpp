// What a container has done between two answers of GetStatistics.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_STATISTICS_INTERVAL_HPP_
#define TAKT_CONTAINERS_STATISTICS_INTERVAL_HPP_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/get_statistics.hpp"

namespace TAKT_INTERNAL takt {

/// Rates are per second; a percentile is missing where nothing was measured.
struct StatisticsInterval {
  struct Times {
    std::optional<Nanoseconds> p50, p99, max;
    explicit Times(const Histogram& part);
    Times() = default;
  };
  struct Thread : GetStatistics::Thread {
    double cpu_percent = 0, wakeups_per_s = 0, preemptions_per_s = 0;
  };
  struct Executor : GetStatistics::Executor {
    std::size_t threads = 0;
    double cpu_percent = 0;  // of its threads
    double rate = 0;         // of its callbacks
    std::uint64_t misses = 0, dropped = 0;
    std::uint64_t all_misses = 0, all_dropped = 0;  // since the start
  };
  struct Callback {
    std::string executor, node, group, callback, kind, topic;
    std::int32_t priority = 0;
    Nanoseconds deadline{0}, budget{0};
    double rate = 0;
    Times latency, execution;
    std::uint64_t misses = 0, overruns = 0, dropped = 0;
    std::uint64_t all_misses = 0, all_overruns = 0, all_dropped = 0;  // since the start
    std::uint64_t backlog = 0;  // messages that wait now, or are being served
    std::string name() const { return node + "/" + callback; }
  };
  struct Chain {
    std::string name;
    Nanoseconds deadline{0};
    double rate = 0;
    Times latency;
    std::uint64_t misses = 0, aborted = 0;
    std::uint64_t all_misses = 0, all_aborted = 0;  // since the start
  };
  struct Topic : GetStatistics::Topic {
    double rate = 0;
    std::uint64_t lately_dropped = 0;
  };

  double seconds = 0, cpu_percent = 0;
  std::vector<Thread> threads;
  std::vector<Executor> executors;
  std::vector<Callback> callbacks;
  std::vector<Chain> chains;
  std::vector<Topic> topics;
};

/// Where `before` is of another process, or empty, the interval is that since `now`'s start, and
/// its rates are 0: nobody knows for how long it has run.
StatisticsInterval interval(const GetStatistics::Response& before,
                            const GetStatistics::Response& now);

}  // namespace takt

#endif  // TAKT_CONTAINERS_STATISTICS_INTERVAL_HPP_
