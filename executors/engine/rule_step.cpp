// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/rule_step.hpp"

#include <utility>

#include "takt/executors/engine/dispatcher.hpp"
#include "takt/nodes/callback_gate.hpp"

namespace takt::detail {

RuleStep::RuleStep(Rule& rule, Dispatcher& dispatcher)
    : rule_(rule), dispatcher_(dispatcher), ready_(dispatcher.ready()), inputs_(ready_) {
  if (rule.logical_outputs()) outputs_ = std::make_unique<StagedOutputs>(*rule.logical_outputs());
}

void RuleStep::install(ScheduleUpdate& update) noexcept {
  inputs_.install(update);
  if (!update.only_removes) executions_.swap(update.executions);
}

void RuleStep::end(ThreadStatistics& statistics) noexcept {
  if (outputs_ == nullptr) return;
  outputs_->publish();
  statistics.missed_periods = rule_.missed_periods();
  statistics.dropped_outputs = outputs_->dropped();
}

std::span<const TriggerInput> RuleInputs::all() const noexcept {
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const CallbackRecord& record = *callbacks_[i];
    inputs_[i] = {record.supervision->node, record.supervision->callback,
                  record.state.state() != RecordState::idle, record.settings.label};
  }
  return {inputs_.data(), callbacks_.size()};
}

void RuleInputs::install(ScheduleUpdate& update) noexcept {
  if (!update.only_removes) {
    callbacks_.swap(update.all);
    inputs_.swap(update.rule_inputs);
  } else {
    for (CallbackRecord* record : update.removed) std::erase(callbacks_, record);
  }
}

bool RuleStep::run_next(Worker& worker, const ReadySet::Limits& limits) noexcept
    TAKT_REQUIRES(dispatcher_.lock()) {
  if (!std::exchange(has_begun_, true)) {
    ready_.timers().read_clock();
    rule_.begin(ready_.timers().now());
  }
  if (outputs_ != nullptr) return run_period(worker);
  for (;;) {
    if (limits.may_poll) look();
    if (!rule_.is_open()) return false;
    if (dispatcher_.run_ready(worker, {limits.last_sequence, /*may_poll=*/false, limits.worker}))
      return true;
    // All waiting callbacks were put aside or left to other workers, so newer arrivals are next.
    if (!limits.may_poll || !ready_.has_more()) return false;
    if (!ready_.queue().is_empty()) ready_.poll();
  }
}

// While the rule is closed, new arrivals join the snapshot that waits.
void RuleStep::look() noexcept {
  const bool is_open = rule_.is_open();
  inputs_.set_was_serving(is_open && !ready_.queue().is_empty());
  is_open ? ready_.take_snapshot() : ready_.poll();
  if (rule_.look(ready_.timers().now(), inputs_))
    ready_.queue().hand_back_all(ready_.selection().take_held());
  if (rule_.may_hold_for_ever()) dispatcher_.observation().set_closed(!rule_.is_open());
}

// Logical execution time, on the only thread: publishes the outputs of the period that ends; then
// takes all inputs of the next one, before any callback runs.
bool RuleStep::run_period(Worker& worker) noexcept TAKT_REQUIRES(dispatcher_.lock()) {
  ready_.timers().read_clock();
  if (ready_.timers().now() < rule_.opens_at()) return false;
  outputs_->publish();
  // A callback may install an update, which replaces the vector for the next period.
  const std::shared_ptr<std::vector<Execution>> keeps = executions_;
  take_inputs(worker, *keeps);
  const CallbackGate::Period period;
  for (Execution& execution : *keeps) {
    CallbackRecord& record = *execution.record;
    if (!record.state.is_removed()) {
      record.exclusion->admit(record);
      record.state.begin();
      if (record.is_reentrant()) ready_.taken(record, execution.slot.more);
      // Its input was taken with those of all others, and has waited since.
      dispatcher_.execute(worker, execution, outputs_.get());
    } else if (execution.is_taken) {  // removed by one of the callbacks before
      record.entity->discard(execution.slot);
    }
    record.state.release();
  }
  return true;
}

void RuleStep::take_inputs(const Worker& worker, std::vector<Execution>& executions) noexcept {
  look();
  executions.clear();
  if (!rule_.is_open()) return;
  while (CallbackRecord* record = ready_.pick({.may_poll = false})) {
    if (ready_.selection().holds(*record)) continue;
    record->state.retain();
    Execution& execution = executions.emplace_back(*record, ready_.exact_time());
    if (record->is_checked)
      execution.is_dropped =
          record->watch_execution(worker.index, dispatcher_.observation().watchdog());
    execution.is_taken = record->entity->take(execution.slot);
  }
}

}  // namespace takt::detail
