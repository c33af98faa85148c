// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/lifecycle_state_machine.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

namespace takt {
namespace {

using State = LifecycleState;
using Id = TransitionId;

constexpr std::array kStates{State::unknown,      State::unconfigured,   State::inactive,
                             State::active,       State::finalized,      State::configuring,
                             State::cleaningup,   State::shuttingdown,   State::activating,
                             State::deactivating, State::errorprocessing};

// ROS 2 gives the results of all callbacks the same three labels.
constexpr std::string_view kSuccess = "transition_success", kFailure = "transition_failure",
                           kError = "transition_error";

constexpr std::array<LifecycleTransition, 25> kTransitions{{
    {Id::configure, "configure", State::unconfigured, State::configuring},
    {Id::on_configure_success, kSuccess, State::configuring, State::inactive},
    {Id::on_configure_failure, kFailure, State::configuring, State::unconfigured},
    {Id::on_configure_error, kError, State::configuring, State::errorprocessing},

    {Id::cleanup, "cleanup", State::inactive, State::cleaningup},
    {Id::on_cleanup_success, kSuccess, State::cleaningup, State::unconfigured},
    {Id::on_cleanup_failure, kFailure, State::cleaningup, State::inactive},
    {Id::on_cleanup_error, kError, State::cleaningup, State::errorprocessing},

    {Id::activate, "activate", State::inactive, State::activating},
    {Id::on_activate_success, kSuccess, State::activating, State::active},
    {Id::on_activate_failure, kFailure, State::activating, State::inactive},
    {Id::on_activate_error, kError, State::activating, State::errorprocessing},

    {Id::deactivate, "deactivate", State::active, State::deactivating},
    {Id::on_deactivate_success, kSuccess, State::deactivating, State::inactive},
    {Id::on_deactivate_failure, kFailure, State::deactivating, State::active},
    {Id::on_deactivate_error, kError, State::deactivating, State::errorprocessing},

    {Id::unconfigured_shutdown, "shutdown", State::unconfigured, State::shuttingdown},
    {Id::inactive_shutdown, "shutdown", State::inactive, State::shuttingdown},
    {Id::active_shutdown, "shutdown", State::active, State::shuttingdown},
    {Id::on_shutdown_success, kSuccess, State::shuttingdown, State::finalized},
    {Id::on_shutdown_failure, kFailure, State::shuttingdown, State::finalized},
    {Id::on_shutdown_error, kError, State::shuttingdown, State::errorprocessing},

    {Id::on_error_success, kSuccess, State::errorprocessing, State::unconfigured},
    {Id::on_error_failure, kFailure, State::errorprocessing, State::finalized},
    {Id::on_error_error, kError, State::errorprocessing, State::finalized},
}};

template <class Condition>
const LifecycleTransition* find(Condition condition) noexcept {
  const auto* found = std::find_if(kTransitions.begin(), kTransitions.end(), condition);
  return found != kTransitions.end() ? found : nullptr;
}

}  // namespace

std::string_view label(LifecycleState state) noexcept {
  switch (state) {
    case State::unknown:
      return "unknown";
    case State::unconfigured:
      return "unconfigured";
    case State::inactive:
      return "inactive";
    case State::active:
      return "active";
    case State::finalized:
      return "finalized";
    case State::configuring:
      return "configuring";
    case State::cleaningup:
      return "cleaningup";
    case State::shuttingdown:
      return "shuttingdown";
    case State::activating:
      return "activating";
    case State::deactivating:
      return "deactivating";
    case State::errorprocessing:
      return "errorprocessing";
  }
  return "unknown";
}

bool is_primary(LifecycleState state) noexcept {
  return state < State::configuring;
}

std::span<const LifecycleState> lifecycle_states() noexcept {
  return kStates;
}

std::span<const LifecycleTransition> lifecycle_transitions() noexcept {
  return kTransitions;
}

std::vector<LifecycleTransition> lifecycle_transitions(LifecycleState from) {
  std::vector<LifecycleTransition> result;
  std::copy_if(kTransitions.begin(), kTransitions.end(), std::back_inserter(result),
               [=](const LifecycleTransition& row) { return row.start == from; });
  return result;
}

const LifecycleTransition* find_transition(LifecycleState from, TransitionId id) noexcept {
  if (!is_primary(from)) return nullptr;
  return find([=](const LifecycleTransition& row) { return row.start == from && row.id == id; });
}

const LifecycleTransition* find_transition(LifecycleState from, std::string_view label) noexcept {
  if (!is_primary(from)) return nullptr;
  return find(
      [=](const LifecycleTransition& row) { return row.start == from && row.label == label; });
}

const LifecycleTransition& find_result(LifecycleState during, CallbackReturn result) noexcept {
  const std::string_view label = result == CallbackReturn::SUCCESS   ? kSuccess
                                 : result == CallbackReturn::FAILURE ? kFailure
                                                                     : kError;
  return *find(
      [=](const LifecycleTransition& row) { return row.start == during && row.label == label; });
}

std::string describe_transitions(LifecycleState from) {
  std::string result;
  for (const LifecycleTransition& row : lifecycle_transitions(from)) {
    if (!is_primary(from)) break;
    result += fmt::format("{}'{}' ({})", result.empty() ? "" : ", ", row.label,
                          static_cast<unsigned>(row.id));
  }
  return result.empty() ? "none" : result;
}

}  // namespace takt
