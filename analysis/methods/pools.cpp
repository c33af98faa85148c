// Snapshots that several threads share: each step of a path waits for what is left of one and for
// its own, and between for each callback of its group. It holds where the threads together have
// more to do than one could, and is far from what occurs. Our own.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Pools final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    if (part.executor.threads == 1) return Answer::none("one thread");
    if (!part.executor.is_wait_set) return Answer::none("no polling points");
    if (part.executor.order != Order::in_windows) return Answer::none("not the order of ROS 2");
    if (part.system.overheads.wake > 0) {
      return Answer::none("its threads do not work at once when there is work");
    }
    if (!path.is_alone()) return Answer::none("something else sends to a callback of the path");
    if (part.executions(path.source, path.last()) > 1) {
      return Answer::none("a callback of the path gets several messages at once");
    }
    Time bound = 0;
    std::vector<Term> terms;
    for (const std::size_t callback : path.callbacks) {
      const Time more = step(part, callback);
      bound = plus(bound, more);
      if (!part.explains) continue;
      terms.push_back(
          {fmt::format("'{}', its group, and its part of two snapshots", part.at(callback).name),
           more});
    }
    const Source& source = part.sources[path.source];
    if (source.messages > 1 || bound > source.curve.least_distance(2)) {
      return Answer::none("another may arrive before the one before is served");
    }
    return {bound, "", std::move(terms)};
  }

 private:
  static Time step(const Part& part, std::size_t callback) {
    const auto threads = static_cast<Count>(part.executor.threads);
    Time group = 0;
    Count mates = 0;
    for (const std::size_t other : part.callbacks) {
      if (part.at(other).group != part.at(callback).group) continue;
      group = plus(group, part.at(other).execution);
      if (other != callback) ++mates;
    }
    // When one of its group ends, the other threads may each have begun something else.
    const Time others = times(part.longest(), (threads - 1) * mates);
    const Time shared = plus(times(2, part.snapshot()), times(2, others));
    return plus(times(2, group), (shared + threads - 1) / threads);
  }
};

}  // namespace
TAKT_REGISTER_METHOD(
    "pools", "snapshots that several threads share", Pools,
    .assumes =
        "several threads with a CPU each that wake up at once; polling points; the order ros; each "
        "callback of the path has one sender; what begins it is served before the "
        "next arrives",
    .source = "our own")
}  // namespace takt::analysis
