// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/modes.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/containers/planning/plan.hpp"

namespace takt {
namespace {

std::vector<ModeDescription> with_normal(std::vector<ModeDescription> described) {
  described.insert(described.begin(), ModeDescription{.name = kNormalMode});
  return described;
}

bool has(const std::vector<ModeDescription::Callback>& list, std::string_view callback) {
  return std::any_of(list.begin(), list.end(),
                     [&](const auto& listed) { return listed.name == callback; });
}

}  // namespace

std::string name_in_modes(const std::shared_ptr<Node>& node, const Entity& entity) {
  return to_string(Chain::Step{node, entity.name()}).substr(1);
}

Modes::Modes(const std::vector<ModeDescription>& described) : modes_(with_normal(described)) {
  static_assert(std::atomic<Wanted>::is_always_lock_free);
}

bool Modes::request(std::string_view name) noexcept {
  for (std::uint32_t i = 0; i < modes_.size(); ++i) {
    if (modes_[i].name != name) continue;
    wanted_.store({i, Cause::component});
    wake();
    return true;
  }
  return false;
}

void Modes::overrun(std::size_t mode) noexcept {
  const Wanted now{static_cast<std::uint32_t>(mode), Cause::overrun};
  Wanted before = wanted_.load();
  do {
    if (before.mode >= now.mode) return;
  } while (!wanted_.compare_exchange_weak(before, now));
  wake();
}

void Modes::want(const std::string& name) {
  const std::vector<std::string> known = names();
  const auto found = std::find(known.begin(), known.end(), name);
  if (found == known.end()) {
    throw Error(fmt::format("no mode is called '{}'", name), suggest(name, known));
  }
  wanted_.store({static_cast<std::uint32_t>(found - known.begin()), Cause::service});
}

void Modes::begin_in(const std::string& name) {
  want(name);
  const std::lock_guard lock(mutex_);
  in_force_ = wanted_.load().mode;
}

void Modes::wake() noexcept {
  if (GuardCondition* const waker = waker_.load()) waker->trigger();
}

Serving Modes::serving(std::size_t mode, const std::string& callback) const {
  constexpr std::string_view kResumed = "/resumed";
  std::string_view name = callback;
  const bool goes_on = name.ends_with(kResumed);
  if (goes_on) name.remove_suffix(kResumed.size());
  if (has(modes_[mode].demote, name)) return Serving::demoted;
  if (!has(modes_[mode].drop, name)) return Serving::usual;
  return goes_on ? Serving::demoted : Serving::dropped;
}

void Modes::serve_as_in(std::size_t mode, const std::shared_ptr<Node>& node) const {
  CallbackParameterChanges changes;
  for (const auto& entity : node->entities()) {
    const Serving before = node->callback_parameters(*entity).serving.value_or(Serving::usual);
    const Serving now = serving(mode, name_in_modes(node, *entity));
    if (now != before) changes.callbacks[entity->name()].serving = now;
  }
  if (!changes.callbacks.empty()) node->set_callback_parameters(changes);
}

void Modes::serve_as_in_force(const std::shared_ptr<Node>& node) const {
  if (modes_.size() == 1) return;
  const std::lock_guard lock(mutex_);
  serve_as_in(in_force_, node);
}

ModelledProcess Modes::modelled(std::size_t mode, ModelledProcess process) const {
  for (ModelledProcess::Callback& callback : process.callbacks) {
    CallbackParameters parameters = callback.parameters();
    parameters.serving = serving(mode, name_in_modes(callback.node, *callback.entity));
    callback.changed = std::move(parameters);
  }
  process.mode = mode;
  return process;
}

void Modes::note(const Wanted& wanted, TimePoint begin, TimePoint end) {
  const ModeDescription& mode = modes_[wanted.mode];
  const std::string cause = wanted.cause == Cause::overrun
                                ? fmt::format("'{}' has overrun", mode.on_overrun->name)
                            : wanted.cause == Cause::component ? "a component asked for it"
                                                               : "it was asked for";
  log(LogLevel::info, "mode '{}': {}", mode.name, cause);
  if (switches_.size() == kMostSwitches) switches_.erase(switches_.begin());
  const auto ns_of = [](TimePoint time) { return time.time_since_epoch().count(); };
  switches_.push_back(
      {.mode = mode.name, .cause = cause, .begin_ns = ns_of(begin), .end_ns = ns_of(end)});
}

std::string Modes::in_force() const {
  const std::lock_guard lock(mutex_);
  return modes_[in_force_].name;
}

std::vector<ProcessResult::ModeSwitch> Modes::switches(TimePoint start) const {
  const std::lock_guard lock(mutex_);
  std::vector<ProcessResult::ModeSwitch> result = switches_;
  for (ProcessResult::ModeSwitch& each : result)
    each.after = std::max(TimePoint(Nanoseconds(each.begin_ns)) - start, Nanoseconds::zero());
  return result;
}

std::vector<std::string> Modes::names() const {
  std::vector<std::string> result;
  for (const ModeDescription& mode : modes_) result.push_back(mode.name);
  return result;
}

bool is_of_user(const OverrunHandler& handler) {
  const auto* const leads = handler.target<OverrunLeadsToMode>();
  return leads != nullptr ? leads->besides != nullptr : handler != nullptr;
}

}  // namespace takt
