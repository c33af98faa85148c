// The workers' policy of an executor: which of its threads may take which callback.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WORKERS_POLICY_HPP_
#define TAKT_EXECUTORS_WORKERS_POLICY_HPP_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/executors/rule.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_PUBLIC takt {

/// A set of an executor's workers: bit i is the worker of the i-th thread.
using WorkerSet = std::uint64_t;
// Limit: threads of an executor with a workers' policy. At it: more are refused. Seen: the error.
inline constexpr std::size_t kMostWorkers = 64;

/// Tells the workers of an executor apart: bands of priorities, workers that belong to groups. For
/// a callback that becomes ready, the first worker of its set that sleeps is woken, and no other. A
/// worker that finds nothing of its own sleeps at once: `spin` and `early_wake` are refused.
/// Without a policy any worker may take each callback. A worker also pops callbacks that it must
/// leave to others, and pushes them back at once in the same order: the scheduler must allow that.
///
/// Thread safety: control threads ask, one at a time; it must only read what never changes.
/// Real-time: it may allocate, except in `precedes`. It costs each dispatch O(callbacks that wait
/// for other workers, × log n) for the choice, and O(workers × timers) to see who else must wake
/// up.
class WorkersPolicy {
 public:
  virtual ~WorkersPolicy() = default;
  /// The workers that may take the callback. Asked when it is added and when its parameters change.
  /// Throws Error to refuse the callback; an empty set is an Error.
  virtual WorkerSet workers_of(const NamedCallback& callback,
                               std::span<const ThreadAttributes> workers) const = 0;

  // ---- Workers that interrupt each other ----

  /// Whether workers interrupt each other. Their threads have ascending priorities, so Linux runs
  /// the later of two first. A callback that may interrupt those that run begins on the next
  /// worker, and the interrupted one goes on afterwards; any other callback waits until one has
  /// ended. Never changes.
  virtual bool interrupts() const noexcept { return false; }
  /// The preemption levels (Baker: "Stack-Based Scheduling of Realtime Processes", Real-Time
  /// Systems 1991) of all callbacks, one for each, from 1. A callback interrupts another one only
  /// if its level is above those of all callbacks in the other one's group. Asked when callbacks
  /// change. May throw Error.
  virtual std::vector<std::uint32_t> levels(std::span<const CallbackInfo> callbacks) const {
    return std::vector<std::uint32_t>(callbacks.size(), 1);
  }
  /// Whether the first of two, which has the higher level, comes before the second one in the
  /// order. On dispatching threads, with the executor's lock: neither blocks nor allocates.
  virtual bool precedes(const ReadyCallback&, const ReadyCallback&) const noexcept { return true; }
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_WORKERS_POLICY_HPP_
