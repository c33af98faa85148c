// The bound of an executor with polling points: a snapshot holds each callback at most once, so
// each step of a path waits for one snapshot at most, and the first for what is left of another.
// It needs no periods, and holds under overload. Our own; the accounting is that of Blaß et al.,
// "A ROS 2 Response-Time Analysis Exploiting Starvation Freedom and Execution-Time Variance"
// (RTSS 2021).
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Snapshots final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    if (part.executor.threads != 1) return Answer::none("several threads share the snapshot");
    if (!part.executor.is_wait_set && part.executor.order != Order::in_windows) {
      return Answer::none("no polling points");
    }
    if (!part.supply.holds_in_any_window()) {
      return Answer::none("more urgent threads of its CPU may be behind when it arrives");
    }
    if (!path.is_alone()) return Answer::none("something else sends to a callback of the path");
    if (part.executions(path.source, path.last()) > 1) {
      return Answer::none("a callback of the path gets several messages at once");
    }

    const Time steps = static_cast<Time>(path.callbacks.size());
    const Time snapshot = part.snapshot(), until_last = part.snapshot_until(path.last());
    const Time bound = part.supply.time_for(plus(times(steps, snapshot), until_last), part.limit);
    const Source& source = part.sources[path.source];
    // Messages, and more releases than one, may queue.
    const bool queues = !part.at(source.callback).has_one_release() || source.from;
    if (queues && (source.messages > 1 || bound > source.curve.least_distance(2))) {
      return Answer::none("a message may arrive before the one before it is served");
    }
    if (!part.explains) return {bound, "", {}};
    std::vector<Term> terms{
        {fmt::format("{} snapshots of all {} callbacks", steps, part.callbacks.size()),
         times(steps, snapshot)},
        {"the last snapshot, up to its last callback", until_last}};
    part.finish(terms, bound, 0);
    return {bound, "", std::move(terms)};
  }
};

}  // namespace
TAKT_REGISTER_METHOD("snapshots", "each step of a path waits for one snapshot at most", Snapshots,
                     .assumes =
                         "one thread, no more urgent one on its CPU; polling points; each "
                         "callback of the path has one sender; a timer begins it, or a "
                         "message that is served before the next arrives",
                     .source = "our own, after Blaß et al., RTSS 2021")
}  // namespace takt::analysis
