// Serves a snapshot of what is ready when a trigger says so, in the order that the user lists: any
// callback is ready, all are, one certain is, or the user's own function of them. With a period, by
// logical execution time (Giotto; rclc's LET): inputs are taken together at its beginning, and
// outputs are sent together at its end, however long the callbacks took. One thread.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/entities/staged_outputs.hpp"
#include "takt/executors/engine/dispatcher.hpp"
#include "takt/executors/engine/serving_rule.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/callback_gate.hpp"

namespace takt {
namespace detail {
namespace {

/// Serves a snapshot when the trigger fires, or, without one, each.
class Triggered : public ServingRule {
 public:
  explicit Triggered(const TriggerOptions& options)
      : options_(options), has_trigger_(options.own || options.kind != TriggerOptions::Kind::any) {}

  bool run_next(Dispatcher& dispatcher, Worker& worker,
                const ReadySet::Limits& limits) noexcept override TAKT_REQUIRES(dispatcher.lock()) {
    if (limits.may_poll) take_snapshot(dispatcher.ready());
    return is_open() && dispatcher.run_ready(worker, {limits.last_sequence, /*may_poll=*/false});
  }
  /// Once the trigger has fired, the snapshot is served to its end.
  void take_snapshot(ReadySet& ready) noexcept override {
    if (!has_trigger_) return ready.take_snapshot();
    if (ready.has_unfinished() && is_open()) return;
    ready.poll();
    is_open_.store(ready.has_unfinished() && fires());
  }
  void prepare(ScheduleUpdate& update) const override {
    if (has_trigger_) update.trigger_inputs.resize(update.all.size());
  }
  void install(ScheduleUpdate& update) noexcept override {
    if (!has_trigger_) return;
    callbacks_.swap(update.all);
    inputs_.swap(update.trigger_inputs);
    const auto one = std::find_if(
        callbacks_.begin(), callbacks_.end(),
        [&](const CallbackRecord* record) { return is_called(*record, options_.one); });
    one_ = one != callbacks_.end() ? *one : nullptr;
  }
  bool has_trigger() const noexcept override { return has_trigger_; }
  bool is_open() const noexcept override { return is_open_.load(); }

 private:
  bool fires() noexcept {
    const auto is_ready = [](const CallbackRecord* record) {
      return record->state.state() != RecordState::idle;
    };
    if (options_.own) {
      for (std::size_t i = 0; i < callbacks_.size(); ++i) {
        inputs_[i] = {callbacks_[i]->supervision->node, callbacks_[i]->supervision->callback,
                      is_ready(callbacks_[i])};
      }
      return options_.own({inputs_.data(), callbacks_.size()});
    }
    switch (options_.kind) {
      case TriggerOptions::Kind::any:
        return std::any_of(callbacks_.begin(), callbacks_.end(), is_ready);
      case TriggerOptions::Kind::all:
        return std::all_of(callbacks_.begin(), callbacks_.end(), is_ready);
      case TriggerOptions::Kind::one:
        return one_ != nullptr && is_ready(one_);
    }
    return false;
  }

  const TriggerOptions& options_;
  const bool has_trigger_;
  std::atomic<bool> is_open_{true};  // the snapshot may be served; written serialised
  std::vector<CallbackRecord*> callbacks_;
  std::vector<TriggerInput> inputs_;     // room for one of each
  const CallbackRecord* one_ = nullptr;  // of Kind::one, while there is such a callback
};

/// The same at the end of each period.
class Periodic final : public Triggered {
 public:
  explicit Periodic(const TriggerOptions& options)
      : Triggered(options), period_(options.let_period), outputs_(options.most_outputs) {}

  /// Runs on the only thread. Publishes the outputs of the period that ends; then takes all inputs
  /// of the next one, before any callback runs.
  bool run_next(Dispatcher& dispatcher, Worker& worker, const ReadySet::Limits&) noexcept override
      TAKT_REQUIRES(dispatcher.lock()) {
    if (!begin_period(dispatcher.ready())) return false;
    // A callback may install an update, which replaces the vector for the next period.
    const std::shared_ptr<std::vector<Execution>> keeps = executions_;
    take_inputs(dispatcher, worker, *keeps);
    const CallbackGate::Period period;
    for (Execution& execution : *keeps) {
      CallbackRecord& record = *execution.record;
      if (!record.state.is_removed()) {
        record.exclusion->admit(record);
        record.state.begin();
        if (record.is_reentrant()) dispatcher.ready().taken(record, execution.slot.more);
        // Its input was taken with those of all others, and has waited since.
        dispatcher.execute(worker, execution, &outputs_);
      } else if (execution.is_taken) {  // removed by one of the callbacks before
        record.entity->discard(execution.slot);
      }
      record.state.release();
    }
    return true;
  }
  void take_snapshot(ReadySet&) noexcept override {}
  void prepare(ScheduleUpdate& update) const override {
    Triggered::prepare(update);
    update.executions = std::make_shared<std::vector<Execution>>();
    update.executions->reserve(update.all.size());
  }
  void install(ScheduleUpdate& update) noexcept override {
    Triggered::install(update);
    executions_.swap(update.executions);
  }
  void end(ThreadStatistics& statistics) noexcept override {
    outputs_.publish();
    statistics.missed_periods = missed_;
    statistics.dropped_outputs = outputs_.dropped();
  }
  std::size_t held_back() const noexcept override { return outputs_.size(); }

 private:
  /// False: it has not come yet.
  bool begin_period(ReadySet& ready) noexcept {
    ready.timers().read_clock();
    TimePoint end = ready.next_release();
    if (end == TimePoint{}) ready.open_at(end = later(ready.timers().now(), period_));
    if (ready.timers().now() < end) return false;
    outputs_.publish();
    const auto missed = (ready.timers().now() - end) / period_;
    missed_ += static_cast<std::uint64_t>(missed);
    ready.open_at(later(end + missed * period_, period_));
    return true;
  }
  void take_inputs(Dispatcher& dispatcher, const Worker& worker,
                   std::vector<Execution>& executions) noexcept {
    Triggered::take_snapshot(dispatcher.ready());
    executions.clear();
    if (!is_open()) return;
    while (CallbackRecord* record = dispatcher.ready().pick({.may_poll = false})) {
      record->state.retain();
      Execution& execution = executions.emplace_back(*record);
      if (record->is_checked) dispatcher.observation().watch_execution(*record, worker);
      execution.is_taken = record->entity->take(execution.slot);
    }
  }

  const Nanoseconds period_;
  StagedOutputs outputs_;
  std::uint64_t missed_ = 0;
  std::shared_ptr<std::vector<Execution>> executions_;  // with room for all callbacks
};

}  // namespace

std::unique_ptr<ServingRule> make_serving_rule(const ExecutorOptions& options) {
  const TriggerOptions& trigger = options.trigger;
  if (trigger.kind == TriggerOptions::Kind::one && trigger.one.empty()) {
    throw Error(
        fmt::format("executor '{}' has a trigger of kind `one` without a callback", options.name),
        "name it: node/callback");
  }
  if (trigger.let_period < Nanoseconds::zero()) {
    throw Error(fmt::format("executor '{}' has a period of {}", options.name,
                            to_string(trigger.let_period)),
                "give a positive one");
  }
  if (trigger.let_period > Nanoseconds::zero()) return std::make_unique<Periodic>(trigger);
  return std::make_unique<Triggered>(trigger);
}

}  // namespace detail

TAKT_REGISTER_EXECUTOR("triggered", "in the user's order when a trigger says so, or by LET (rclc)",
                       .readiness = Readiness::wait_set, .scheduler = "listed", .triggered = true)

}  // namespace takt
