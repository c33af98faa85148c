// What a container has done between two answers of GetStatistics.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_STATISTICS_INTERVAL_HPP_
#define TAKT_CONTAINERS_STATISTICS_INTERVAL_HPP_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/fields.hpp"
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
  /// Of callbacks. In each row, `faults` are of the interval, and `all_faults` since the start.
  struct Faults {
    std::uint64_t deadline_misses = 0, overruns = 0, dropped = 0;
  };
  struct ChainFaults {
    std::uint64_t misses = 0, aborted = 0;
  };
  struct Thread : GetStatistics::Thread {
    double cpu_percent = 0, wakeups_per_s = 0, preemptions_per_s = 0;
  };
  struct Executor : GetStatistics::Executor {
    std::size_t threads = 0;
    double cpu_percent = 0;     // of its threads
    double rate = 0;            // of its callbacks
    Faults faults, all_faults;  // of its callbacks
  };
  struct Callback {
    std::string executor, node, group, callback, kind, topic;
    std::int32_t priority = 0;
    Nanoseconds deadline{0}, budget{0};
    double rate = 0;
    Times latency, execution;
    Faults faults, all_faults;
    std::uint64_t backlog = 0;  // messages that wait now, or are being served
    std::string name() const { return node + "/" + callback; }
  };
  struct Chain {
    std::string name;
    Nanoseconds deadline{0};
    double rate = 0;
    Times latency;
    ChainFaults faults, all_faults;
  };
  struct Topic : GetStatistics::Topic {
    double rate = 0;
    std::uint64_t lately_dropped = 0;
  };
  struct Deviation : GetStatistics::Deviation {
    std::size_t place = 0;  // in the list
    std::uint64_t lately = 0;
  };

  double seconds = 0, cpu_percent = 0;
  std::vector<Thread> threads;
  std::vector<Executor> executors;
  std::vector<Callback> callbacks;
  std::vector<Chain> chains;
  std::vector<Topic> topics;
  bool watches_bounds = false;
  std::vector<Deviation> deviations;
};

template <>
inline constexpr auto kFields<StatisticsInterval::Faults> =
    std::tuple{sum("deadline_misses", &StatisticsInterval::Faults::deadline_misses, ""),
               sum("overruns", &StatisticsInterval::Faults::overruns, ""),
               sum("dropped", &StatisticsInterval::Faults::dropped, "")};
template <>
inline constexpr auto kFields<StatisticsInterval::ChainFaults> =
    std::tuple{sum("misses", &StatisticsInterval::ChainFaults::misses, ""),
               sum("aborted", &StatisticsInterval::ChainFaults::aborted, "")};

/// If `before` is empty or of another process, the interval begins at the start of `now`'s process,
/// and all rates are 0, because its run time is not known.
StatisticsInterval interval(const GetStatistics::Response& before,
                            const GetStatistics::Response& now);

}  // namespace takt

#endif  // TAKT_CONTAINERS_STATISTICS_INTERVAL_HPP_
