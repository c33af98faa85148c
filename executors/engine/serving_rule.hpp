// The step that triggered executors do in another way: what is served, and when.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_SERVING_RULE_HPP_
#define TAKT_EXECUTORS_ENGINE_SERVING_RULE_HPP_

#include <cstddef>
#include <memory>

#include "takt/executors/engine/ready_set.hpp"
#include "takt/executors/executor.hpp"

namespace takt::detail {

class Dispatcher;
struct Worker;

/// Takes the place of "pick the next callback, and run it".
/// Thread safety: the constants are from any thread, all else is serialised by the executor.
/// Real-time: but for prepare, nothing blocks or allocates, unless the user's trigger does.
class ServingRule {
 public:
  virtual ~ServingRule() = default;

  /// As Dispatcher::run_next.
  virtual bool run_next(Dispatcher& dispatcher, Worker& worker,
                        const ReadySet::Limits& limits) noexcept = 0;
  /// Before spin_some: which callbacks it runs.
  virtual void take_snapshot(ReadySet& ready) noexcept = 0;
  /// A control thread gives an update the memory that its callbacks will need here.
  virtual void prepare(ScheduleUpdate& update) const = 0;
  virtual void install(ScheduleUpdate& update) noexcept = 0;
  /// The last callback has run.
  virtual void end(ThreadStatistics&) noexcept {}

  virtual bool has_trigger() const noexcept = 0;
  /// Whether what is ready will be served, and does not wait for the trigger.
  virtual bool is_open() const noexcept = 0;
  /// Messages that wait for the end of a period.
  virtual std::size_t held_back() const noexcept { return 0; }
};

/// By a trigger, a period, or both. In triggered_executor.cpp. Throws Error.
std::unique_ptr<ServingRule> make_serving_rule(const ExecutorOptions& options);

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_SERVING_RULE_HPP_
