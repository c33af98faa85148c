// How a rule is asked at each dispatch.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_RULE_STEP_HPP_
#define TAKT_EXECUTORS_ENGINE_RULE_STEP_HPP_

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "takt/entities/staged_outputs.hpp"
#include "takt/executors/engine/ready_set.hpp"
#include "takt/executors/engine/schedule_update.hpp"
#include "takt/executors/executor.hpp"

namespace takt::detail {

class Dispatcher;
struct Worker;

/// What a rule sees of the callbacks.
/// Thread safety: serialised by the executor. Real-time: nothing blocks or allocates.
class RuleInputs final : public ReadyCallbacks {
 public:
  explicit RuleInputs(const ReadySet& ready) : ready_(ready) {}

  void set_was_serving(bool serving) noexcept { was_serving_ = serving; }
  bool any() const noexcept override { return !ready_.queue().is_empty(); }
  bool was_serving() const noexcept override { return was_serving_; }
  std::span<const TriggerInput> all() const noexcept override;
  /// Swaps its memory for that of the update; one that only removes brings none.
  void install(ScheduleUpdate& update) noexcept;

 private:
  const ReadySet& ready_;
  bool was_serving_ = false;
  std::vector<CallbackRecord*> callbacks_;
  mutable std::vector<TriggerInput> inputs_;  // room for one of each
};

/// Takes the place of "pick the next callback, and run it" where an executor has a rule.
/// Thread safety: serialised by the executor, but for held_back.
/// Real-time: nothing blocks or allocates, unless the user's trigger does.
class RuleStep {
 public:
  RuleStep(Rule& rule, Dispatcher& dispatcher);

  /// Dispatcher::run_next with a rule. Out of line, so that the path without a rule stays small.
  [[gnu::noinline]] bool run_next(Worker& worker, const ReadySet::Limits& limits) noexcept;
  /// Before spin_some: takes the snapshot that it runs.
  void take_snapshot() noexcept {
    if (outputs_ == nullptr) look();  // else a period takes its own
  }
  void install(ScheduleUpdate& update) noexcept;
  /// Called after the last callback. With logical execution time, sends the staged outputs.
  void end(ThreadStatistics& statistics) noexcept;
  /// How many staged outputs wait for the end of a period. Any thread.
  std::size_t held_back() const noexcept { return outputs_ != nullptr ? outputs_->size() : 0; }

 private:
  [[gnu::noinline]] void look() noexcept;
  bool run_period(Worker& worker) noexcept;
  void take_inputs(const Worker& worker, std::vector<Execution>& executions) noexcept;

  Rule& rule_;
  Dispatcher& dispatcher_;
  ReadySet& ready_;
  RuleInputs inputs_;
  bool has_begun_ = false;
  std::unique_ptr<StagedOutputs> outputs_;              // with logical execution time
  std::shared_ptr<std::vector<Execution>> executions_;  // the same, with room for all callbacks
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_RULE_STEP_HPP_
