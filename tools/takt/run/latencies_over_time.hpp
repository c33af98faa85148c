// The latencies of messages over the time of a run.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_LATENCIES_OVER_TIME_HPP_
#define TAKT_TOOLS_TAKT_LATENCIES_OVER_TIME_HPP_

#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/container.hpp"
#include "takt/measuring/over_time.hpp"

namespace takt::tools {

/// Of the messages that a container's callbacks serve. Its thread looks a few times a second, later
/// less often, at what the executors have counted; their threads do nothing for it.
class LatenciesOverTime {
 public:
  explicit LatenciesOverTime(const Container& container) : container_(container) {}
  /// The timers have been released.
  void begin();
  /// When to look next; kNever before begin() and after end().
  TimePoint due() const noexcept { return due_; }
  void look();
  /// The last look. Returns what combined_over_time() takes: null without begin().
  nlohmann::json end();

 private:
  const Container& container_;
  rt::OverTime over_time_{std::chrono::milliseconds(125)};
  Histogram before_;
  TimePoint begin_{}, last_{}, due_ = kNever;
};

/// Of the parts of all processes, as rt::over_time_json(); null if there is none.
nlohmann::json combined_over_time(const std::vector<nlohmann::json>& parts);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_LATENCIES_OVER_TIME_HPP_
