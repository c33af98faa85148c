// Implements TraceContainer. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_RUNNING_TRACE_HPP_
#define TAKT_CONTAINERS_RUNNING_TRACE_HPP_

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/trace_clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/running_executors.hpp"
#include "takt/containers/trace_container.hpp"
#include "takt/containers/watching/scheduling.hpp"

namespace TAKT_INTERNAL takt {

/// The trace of a running container. Thread safety: every method from any thread. Real-time: no;
/// threads of executors store 88 bytes for each execution, and read their CPU time twice.
class RunningTrace {
 public:
  explicit RunningTrace(RunningExecutors& executors) : executors_(executors) {}
  ~RunningTrace();
  RunningTrace(const RunningTrace&) = delete;
  RunningTrace& operator=(const RunningTrace&) = delete;
  /// The answer reports errors.
  TraceContainer::Response serve(const TraceContainer::Request& request);

 private:
  struct Begun {
    std::string name;
    TraceClock clock;
    Nanoseconds offset;
    TimePoint at;
    Scheduling scheduling;
  };

  void start(const std::string& clock);
  void stop(TraceContainer::Response& answer);
  void read(std::size_t page, TraceContainer::Response& answer);
  std::size_t room() const;

  RunningExecutors& executors_;
  std::mutex mutex_;  // guards what follows
  std::unique_ptr<Begun> begun_;
  /// A stopped trace, which the client has not written yet.
  struct Kept {
    Kept(TraceContainer::Response answer, std::vector<TraceContainer::Event> all,
         std::vector<TraceContainer::Switch> of_kernel)
        : stopped(std::move(answer)), events(std::move(all)), switches(std::move(of_kernel)) {}
    TraceContainer::Response stopped;
    std::vector<TraceContainer::Event> events;
    std::vector<TraceContainer::Switch> switches;
  };
  std::optional<Kept> kept_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_RUNNING_TRACE_HPP_
