// The rule of an executor: which of the ready callbacks may be served now.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_RULE_HPP_
#define TAKT_EXECUTORS_RULE_HPP_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/sched/scheduler.hpp"

namespace TAKT_PUBLIC takt {

/// A callback of the executor, for rules and workers' policies.
struct NamedCallback {
  std::string_view node, callback;  // "/node", "callback"
  const CallbackInfo& info;

  /// Whether this is its name: "node/callback", with or without the first slash of either.
  bool is_called(std::string_view name) const noexcept;
};

/// The state of one callback, for a rule or a trigger.
struct TriggerInput {
  std::string_view node, callback;  // "/node", "callback"
  bool is_ready = false;
  std::uint64_t label = 0;  // what Rule::label has said of it
};

/// What is ready when a rule is asked.
/// Thread safety: none; it lives as long as the call that gets it.
/// Real-time: nothing blocks or allocates.
class ReadyCallbacks {
 public:
  /// Whether a callback waits in the order; those that the rule does not admit do not count.
  virtual bool any() const noexcept = 0;
  /// Whether the rule was open and callbacks waited before the newest arrivals were looked at: it
  /// is still serving.
  virtual bool was_serving() const noexcept = 0;
  /// All callbacks of the executor. O(n).
  virtual std::span<const TriggerInput> all() const noexcept = 0;

 protected:
  ~ReadyCallbacks() = default;
};

/// Decides what may be served, and when: a trigger, windows of time, a budget, a mode. The order
/// still decides which of the admitted callbacks is next. A callback that is not admitted keeps its
/// place in the order of arrival, and waits.
///
/// Thread safety: none needed: the executor serialises all calls but `label`, which control threads
/// call one at a time, and which must only read what never changes.
/// Real-time: everything but the constructor and `label` runs on dispatching threads with the
/// executor's lock: no allocation, no lock, no unbounded step.
class Rule {
 public:
  virtual ~Rule() = default;

  /// A number of the rule's own that comes back with each question about this callback: the set of
  /// windows in which it may run, say. Asked when it is added and when its parameters change. May
  /// allocate, and throws Error to refuse the callback.
  virtual std::uint64_t label(const NamedCallback&) const { return 0; }

  /// Once, before the first dispatch of the first spin.
  virtual void begin(TimePoint /*now*/) noexcept {}
  /// Before a callback is chosen; while the executor is idle, not at all, however long. `now` is
  /// the time of the last clock reading, at most one callback ago. Returns true if the rule admits
  /// more than before: then all that waited for it is considered again.
  virtual bool look(TimePoint /*now*/, const ReadyCallbacks&) noexcept { return false; }
  /// False: nothing at all is served.
  virtual bool is_open() const noexcept { return true; }
  /// Whether this callback may be served. Asked only while the rule is open.
  virtual bool admits(const ReadyCallback&, std::uint64_t /*label*/) const noexcept { return true; }
  /// When `look` must be called, though nothing has become ready; kNever: not by time alone. Asked
  /// only while something waits that the rule does not serve, so an idle executor sleeps on. Later
  /// than the `now` of the last look: else the thread does not sleep.
  virtual TimePoint opens_at() const noexcept { return kNever; }
  /// A callback that it has admitted begins; not asked with logical execution time. Only called
  /// with `uses_time`, as `done` is for the same callback and label.
  virtual void begins(const ReadyCallback&, std::uint64_t /*label*/) noexcept {}
  /// A callback has run for this time. Only called with `uses_time`.
  virtual void done(const ReadyCallback&, std::uint64_t /*label*/,
                    Nanoseconds /*execution_time*/) noexcept {}

  // ---- What never changes ----

  /// Looks at times. Without it, executors with statistics below `full` read the clock less often.
  virtual bool uses_time() const noexcept { return true; }
  /// What it does not admit may wait for ever: such callbacks are neither pending when a run ends,
  /// nor are their messages lost.
  virtual bool may_hold_for_ever() const noexcept { return false; }
  /// Logical execution time: what arrives is looked at only at `opens_at`, and wakes nobody; all
  /// inputs are taken together before the first callback runs; what the callbacks publish is sent
  /// at the next opening. The number of messages that can wait for that; more are dropped and
  /// counted. For one thread only.
  virtual std::optional<std::size_t> logical_outputs() const noexcept { return std::nullopt; }
  /// The openings of a logical execution time that came while the last one was still served.
  virtual std::uint64_t missed_periods() const noexcept { return 0; }
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_RULE_HPP_
