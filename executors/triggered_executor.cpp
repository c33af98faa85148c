// Serves a snapshot of the ready callbacks when a trigger fires (any is ready, all are, a certain
// one is, or a function of the user's says so), in the order that the user lists. With a period:
// logical execution time (Giotto; rclc's LET): inputs are taken together at its beginning, and
// outputs are sent together at its end, however long the callbacks took. One thread.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/executors/executor.hpp"

namespace takt {
namespace {

/// Serves a snapshot to its end when the trigger fires; without a trigger, every snapshot.
class TriggerRule : public Rule {
 public:
  explicit TriggerRule(const ExecutorOptions& options)
      : trigger_(options.trigger),
        has_trigger_(trigger_.own || trigger_.kind != TriggerOptions::Kind::any) {
    if (trigger_.kind != TriggerOptions::Kind::one || !trigger_.one.empty()) return;
    throw Error(
        fmt::format("executor '{}' has a trigger of kind `one` without a callback", options.name),
        "name it: node/callback");
  }

  std::uint64_t label(const NamedCallback& callback) const override {
    return callback.is_called(trigger_.one) ? 1 : 0;
  }
  bool look(TimePoint, const ReadyCallbacks& ready) noexcept override {
    if (has_trigger_ && !ready.was_serving()) is_open_ = ready.any() && fires(ready.all());
    return false;
  }
  bool is_open() const noexcept override { return is_open_; }
  bool uses_time() const noexcept override { return false; }
  bool may_hold_for_ever() const noexcept override { return has_trigger_; }

 private:
  bool fires(std::span<const TriggerInput> callbacks) noexcept {
    if (trigger_.own) return trigger_.own(callbacks);
    const auto is_ready = [](const TriggerInput& callback) { return callback.is_ready; };
    switch (trigger_.kind) {
      case TriggerOptions::Kind::any:
        return std::any_of(callbacks.begin(), callbacks.end(), is_ready);
      case TriggerOptions::Kind::all:
        return std::all_of(callbacks.begin(), callbacks.end(), is_ready);
      case TriggerOptions::Kind::one:
        return std::any_of(callbacks.begin(), callbacks.end(), [](const TriggerInput& callback) {
          return callback.is_ready && callback.label != 0;
        });
    }
    return false;
  }

  const TriggerOptions trigger_;
  const bool has_trigger_;
  bool is_open_ = true;
};

/// The same at the end of each period.
class PeriodicRule final : public TriggerRule {
 public:
  explicit PeriodicRule(const ExecutorOptions& options)
      : TriggerRule(options),
        period_(options.trigger.let_period),
        most_outputs_(options.trigger.most_outputs) {
    if (period_ > Nanoseconds::zero()) return;
    throw Error(fmt::format("executor '{}' has a period of {}", options.name, to_string(period_)),
                "give a positive one");
  }

  void begin(TimePoint now) noexcept override { end_ = later(now, period_); }
  bool look(TimePoint now, const ReadyCallbacks& ready) noexcept override {
    const auto missed = (now - end_) / period_;
    missed_ += static_cast<std::uint64_t>(missed);
    end_ = later(end_ + missed * period_, period_);
    return TriggerRule::look(now, ready);
  }
  TimePoint opens_at() const noexcept override { return end_; }
  std::optional<std::size_t> logical_outputs() const noexcept override { return most_outputs_; }
  std::uint64_t missed_periods() const noexcept override { return missed_; }

 private:
  const Nanoseconds period_;
  const std::size_t most_outputs_;
  TimePoint end_{};
  std::uint64_t missed_ = 0;
};

std::unique_ptr<Rule> make_trigger(const ExecutorOptions& options) {
  if (options.trigger.let_period != Nanoseconds::zero())
    return std::make_unique<PeriodicRule>(options);
  if (!options.trigger.own && options.trigger.kind == TriggerOptions::Kind::any) return nullptr;
  return std::make_unique<TriggerRule>(options);
}

}  // namespace

TAKT_REGISTER_EXECUTOR("triggered", "in the user's order when a trigger says so, or by LET (rclc)",
                       .readiness = Readiness::wait_set, .scheduler = "listed", .triggered = true,
                       .rule = make_trigger)

}  // namespace takt
