// GetStatistics: the service that tells what a running container has done so far.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_GET_STATISTICS_HPP_
#define TAKT_CONTAINERS_GET_STATISTICS_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/base/histogram.hpp"
#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"

namespace TAKT_PUBLIC takt {

/// The service `/CONTAINER/get_statistics`. Each container that has
/// SetCallbackParameters has it, too. All counts are since the start: rates and percentiles of an
/// interval are the difference of two answers. It costs nothing while nobody asks, and the threads
/// of executors never work for it.
struct GetStatistics {
  /// A histogram: its buckets that are not empty.
  struct Times {
    std::uint64_t count = 0;
    std::int64_t sum_ns = 0, min_ns = 0, max_ns = 0;
    std::vector<std::uint16_t> buckets;
    std::vector<std::uint32_t> counts;

    static Times of(const Histogram& histogram);
    /// The samples since `before`; minimum and maximum are only as exact as the buckets.
    /// The numbers may be untrusted input.
    Histogram since(const Times& before) const;
  };
  /// A thread, with what the kernel says of it.
  struct Thread {
    std::string executor;  // whose callbacks run on this thread; empty: none
    std::string name;
    std::int32_t tid = 0;
    std::string policy;
    std::int32_t priority = 0, nice = 0;
    std::vector<std::int32_t> affinity;
    std::int64_t cpu_time_ns = 0;
    std::uint64_t wakeups = 0;      // it slept, or gave up the CPU: voluntary context switches
    std::uint64_t preemptions = 0;  // it lost the CPU: involuntary ones
  };
  struct Executor {
    std::string name, type, scheduler;
    std::uint64_t pending = 0;  // callbacks that are ready or running
  };
  struct Callback {
    std::string executor, node, group, callback, kind, topic;
    std::int32_t priority = 0;
    std::int64_t deadline_ns = 0, budget_ns = 0;  // 0: none
    std::uint64_t received = 0, expected = 0, dropped = 0, deadline_misses = 0, overruns = 0;
    Times latency, execution;
  };
  struct Chain {
    std::string name;
    std::int64_t deadline_ns = 0;
    std::uint64_t instances = 0, misses = 0, aborted = 0;
    Times latency;
  };
  struct Topic {
    std::string name, type;
    std::uint32_t publishers = 0, subscriptions = 0;  // of this process
    std::uint32_t outside = 0;                        // their matches in other processes
    std::uint64_t messages = 0;                       // that this process has counted
    std::uint64_t dropped = 0;                        // by its subscriptions
  };
  /// An assumption of the analysis that did not hold. It keeps its place in the list; its text
  /// changes when a worse case is seen.
  struct Deviation {
    std::string id;  // the assumption, see `takt analyze`; "bound": a bound was exceeded
    std::string text;
    std::vector<std::string> chains;  // whose bounds depend on it
    std::uint64_t count = 0;
  };
  struct Request {};
  struct Response {
    std::int32_t pid = 0;
    std::int64_t time_ns = 0;  // CLOCK_MONOTONIC
    std::int64_t cpu_time_ns = 0;
    std::vector<Thread> threads;
    std::vector<Executor> executors;
    std::vector<Callback> callbacks;
    std::vector<Chain> chains;
    std::vector<Topic> topics;
    bool watches_bounds = false;  // else nobody looks for deviations
    std::vector<Deviation> deviations;
  };
};
TAKT_MESSAGE(GetStatistics::Times, "takt_interfaces/msg/Times", count, sum_ns, min_ns, max_ns,
             buckets, counts);
TAKT_MESSAGE(GetStatistics::Thread, "takt_interfaces/msg/ThreadStatistics", executor, name, tid,
             policy, priority, nice, affinity, cpu_time_ns, wakeups, preemptions);
TAKT_MESSAGE(GetStatistics::Executor, "takt_interfaces/msg/ExecutorStatistics", name, type,
             scheduler, pending);
TAKT_MESSAGE(GetStatistics::Callback, "takt_interfaces/msg/CallbackStatistics", executor, node,
             group, callback, kind, topic, priority, deadline_ns, budget_ns, received, expected,
             dropped, deadline_misses, overruns, latency, execution);
TAKT_MESSAGE(GetStatistics::Chain, "takt_interfaces/msg/ChainStatistics", name, deadline_ns,
             instances, misses, aborted, latency);
TAKT_MESSAGE(GetStatistics::Topic, "takt_interfaces/msg/TopicStatistics", name, type, publishers,
             subscriptions, outside, messages, dropped);
TAKT_MESSAGE(GetStatistics::Deviation, "takt_interfaces/msg/Deviation", id, text, chains, count);
TAKT_MESSAGE(GetStatistics::Request, "takt_interfaces/srv/GetStatistics_Request");
TAKT_MESSAGE(GetStatistics::Response, "takt_interfaces/srv/GetStatistics_Response", pid, time_ns,
             cpu_time_ns, threads, executors, callbacks, chains, topics, watches_bounds,
             deviations);

}  // namespace takt

#endif  // TAKT_CONTAINERS_GET_STATISTICS_HPP_
