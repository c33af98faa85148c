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
  std::uint64_t label = 0;  // the one that Rule::label gave it
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
  /// windows in which it may run, say. Asked when the callback is added and when its parameters
  /// change. May allocate, and throws Error to refuse the callback.
  virtual std::uint64_t label(const NamedCallback&) const { return 0; }

  /// Once, before the first dispatch of the first spin.
  virtual void begin(TimePoint /*now*/) noexcept {}
  /// Called before a callback is chosen, but not while the executor is idle, however long that is.
  /// `now` is the time of the last clock reading, at most one callback ago. Returns true if the
  /// rule admits more than before: then all callbacks that it has held are considered again.
  virtual bool look(TimePoint /*now*/, const ReadyCallbacks&) noexcept { return false; }
  /// False: nothing at all is served.
  virtual bool is_open() const noexcept { return true; }
  /// Whether this callback may be served. Asked only while the rule is open.
  virtual bool admits(const ReadyCallback&, std::uint64_t /*label*/) const noexcept { return true; }
  /// The time at which `look` must be called, even if nothing has become ready; kNever: time alone
  /// does not matter. Asked only while a callback waits that the rule does not serve, so an idle
  /// executor sleeps on. Must be later than the `now` of the last look, or the thread never sleeps.
  virtual TimePoint opens_at() const noexcept { return kNever; }
  /// An admitted callback begins. Called only with `uses_time`, and not with logical execution
  /// time. `done` follows, with the same callback and label.
  virtual void begins(const ReadyCallback&, std::uint64_t /*label*/) noexcept {}
  /// A callback has run for this time. Only called with `uses_time`.
  virtual void done(const ReadyCallback&, std::uint64_t /*label*/,
                    Nanoseconds /*execution_time*/) noexcept {}

  // ---- What never changes ----

  /// Whether the rule uses times. If not, executors with statistics below `full` read the clock
  /// less often.
  virtual bool uses_time() const noexcept { return true; }
  /// Whether callbacks that the rule does not admit may wait for ever: then they are not pending
  /// when a run ends, and their messages are not lost.
  virtual bool may_hold_for_ever() const noexcept { return false; }
  /// Logical execution time: arrivals are looked at only at `opens_at`, and wake nobody; all inputs
  /// are taken together before the first callback runs; outputs are sent at the next opening.
  /// Returns how many messages can wait for that; more are dropped and counted. For one thread
  /// only.
  virtual std::optional<std::size_t> logical_outputs() const noexcept { return std::nullopt; }
  /// With logical execution time: openings that came while the last period was still served.
  virtual std::uint64_t missed_periods() const noexcept { return 0; }
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_RULE_HPP_
