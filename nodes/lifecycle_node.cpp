// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/lifecycle_node.hpp"

#include <exception>
#include <mutex>

#include <fmt/format.h>

#include "takt/base/logger.hpp"
#include "takt/base/tracepoints.hpp"

namespace takt {

LifecycleNode::LifecycleNode(std::string_view name, const NodeOptions& options)
    : Node(name, options) {
  if (const Tracepoints* const points = tracepoints())
    points->rcl_lifecycle_state_machine_init(static_cast<Node*>(this), this);
}

// ---- Callbacks that the user need not write ----

CallbackReturn LifecycleNode::on_configure(LifecycleState) {
  return CallbackReturn::SUCCESS;
}
CallbackReturn LifecycleNode::on_cleanup(LifecycleState) {
  return CallbackReturn::SUCCESS;
}
CallbackReturn LifecycleNode::on_activate(LifecycleState) {
  return CallbackReturn::SUCCESS;
}
CallbackReturn LifecycleNode::on_deactivate(LifecycleState) {
  return CallbackReturn::SUCCESS;
}
CallbackReturn LifecycleNode::on_shutdown(LifecycleState) {
  return CallbackReturn::SUCCESS;
}
CallbackReturn LifecycleNode::on_error(LifecycleState) {
  return CallbackReturn::FAILURE;
}

// ---- Requests ----

TransitionResult LifecycleNode::trigger_transition(std::string_view label) {
  return request(label, fmt::format("'{}'", label));
}

TransitionResult LifecycleNode::trigger_transition(TransitionId id) {
  return request(id, fmt::format("transition {}", static_cast<unsigned>(id)));
}

template <class Request>
TransitionResult LifecycleNode::request(Request which, const std::string& name) {
  if (is_changing_.exchange(true)) {
    const LifecycleState state = get_current_state();
    return {std::nullopt, state,
            fmt::format("{} of node '{}' was refused: another transition is under way, in state "
                        "'{}'; ask again when it has ended",
                        name, fully_qualified_name(), label(state))};
  }
  const struct End {  // whatever throws
    std::atomic<bool>& is_changing;
    ~End() {
      is_changing.store(false);
      is_changing.notify_all();
    }
  } end{is_changing_};
  const LifecycleState before = get_current_state();
  const LifecycleTransition* transition = find_transition(before, which);
  if (transition == nullptr) {
    return {std::nullopt, before,
            fmt::format("{} of node '{}' was refused: the node is {}; possible are: {}", name,
                        fully_qualified_name(), label(before), describe_transitions(before))};
  }
  TransitionResult result{go_through(*transition), get_current_state(), {}};
  if (!result) {
    result.message =
        fmt::format("{} of node '{}' ended with {}: the node is {}; possible are: {}", name,
                    fully_qualified_name(),
                    result.returned == CallbackReturn::FAILURE ? "a failure" : "an error",
                    label(result.state), describe_transitions(result.state));
  }
  return result;
}

void LifecycleNode::bring_down() {
  bool has_failed = false, is_over = false;
  while (!is_over) {
    // Waits for a transition. The thread that unloads the node limits how long it waits for this
    // one.
    is_changing_.wait(true);
    const LifecycleState state = get_current_state();
    if (state == LifecycleState::finalized) return;
    const std::string_view next = has_failed                          ? "shutdown"
                                  : state == LifecycleState::active   ? "deactivate"
                                  : state == LifecycleState::inactive ? "cleanup"
                                                                      : "shutdown";
    const TransitionResult result = trigger_transition(next);
    has_failed |= result.returned && !result;
    is_over = result.returned && next == "shutdown";  // its on_error may not finalize the node
  }
}

// 1. The node leaves its state. If that was `active`, the managed entities come to rest.
// 2. The callback of the transition runs; what it returns leads to the next state.
// 3. If that is `errorprocessing`, on_error runs, and leads to another.
// 4. If the node is active now, the managed entities begin.
CallbackReturn LifecycleNode::go_through(const LifecycleTransition& transition) {
  const LifecycleState previous = transition.start;
  step(transition);
  if (previous == LifecycleState::active) stop_managed();
  const CallbackReturn returned = call(transition.goal, previous);
  step(find_result(transition.goal, returned));
  if (get_current_state() == LifecycleState::errorprocessing) {
    step(find_result(LifecycleState::errorprocessing,
                     call(LifecycleState::errorprocessing, previous)));
  }
  return returned;
}

void LifecycleNode::step(const LifecycleTransition& transition) {
  state_.store(transition.goal);
  if (const Tracepoints* const points = tracepoints()) {
    points->rcl_lifecycle_transition(this, label(transition.start).data(),
                                     label(transition.goal).data());
  }
  // Before the listener is called: it may rely on an active node.
  if (transition.goal == LifecycleState::active) start_managed();
  std::unique_lock lock(listener_mutex_);
  const auto listener = listener_;
  lock.unlock();
  if (listener != nullptr) listener->call([&](const auto& function) { function(transition); });
}

void LifecycleNode::set_transition_listener(TransitionListener listener) {
  auto entry = listener ? std::make_shared<Listener>(std::move(listener)) : nullptr;
  {
    const std::lock_guard lock(listener_mutex_);
    entry.swap(listener_);
  }
  if (entry != nullptr) entry->remove();
}

CallbackReturn LifecycleNode::call(LifecycleState during, LifecycleState previous) noexcept {
  try {
    const CallbackReturn returned = call_unguarded(during, previous);
    if (returned != CallbackReturn::SUCCESS && returned != CallbackReturn::FAILURE) {
      return CallbackReturn::ERROR;  // includes numbers that are not in the enumeration
    }
    return returned;
  } catch (const std::exception& exception) {
    log(LogLevel::error, "node '{}', {}: {}", fully_qualified_name(), label(during),
        exception.what());
  } catch (...) {
    log(LogLevel::error, "node '{}', {}: an exception of an unknown type", fully_qualified_name(),
        label(during));
  }
  return CallbackReturn::ERROR;
}

CallbackReturn LifecycleNode::call_unguarded(LifecycleState during, LifecycleState previous) {
  switch (during) {
    case LifecycleState::configuring:
      return on_configure(previous);
    case LifecycleState::cleaningup:
      return on_cleanup(previous);
    case LifecycleState::activating:
      return on_activate(previous);
    case LifecycleState::deactivating:
      return on_deactivate(previous);
    case LifecycleState::shuttingdown:
      return on_shutdown(previous);
    default:
      return on_error(previous);
  }
}

// ---- Managed entities ----

std::shared_ptr<Timer> LifecycleNode::make_timer(Clock& clock, std::string name, Nanoseconds period,
                                                 std::function<void()> callback,
                                                 std::shared_ptr<CallbackGroup> group) {
  auto timer = std::make_shared<ManagedTimer<Timer>>(gate_, std::move(name),
                                                     group_or_default(std::move(group)), clock,
                                                     period, std::move(callback));
  manage(timer);
  return adopt_timer(timer);
}

std::shared_ptr<TaskRunner> LifecycleNode::managed_task_runner(
    const std::string& callback, const std::shared_ptr<CallbackGroup>& group) {
  auto runner = std::make_shared<ManagedTaskRunner>(gate_, callback, group, clock(), 1u);
  manage(runner);
  return adopt_task_runner(std::move(runner));
}

void LifecycleNode::manage(const std::shared_ptr<Managed>& entity) {
  const std::lock_guard lock(managed_mutex_);
  std::erase_if(managed_, [](const auto& known) { return known.expired(); });
  managed_.push_back(entity);
}

std::vector<std::shared_ptr<Managed>> LifecycleNode::managed() const {
  const std::lock_guard lock(managed_mutex_);
  std::vector<std::shared_ptr<Managed>> result;
  for (const auto& entity : managed_) {
    if (auto alive = entity.lock()) result.push_back(std::move(alive));
  }
  return result;
}

void LifecycleNode::start_managed() {
  for (const auto& entity : managed()) entity->opens();
  gate_->open();
  // Calls managed() again: an entity that an executor has attached since then saw the gate closed.
  for (const auto& entity : managed()) entity->has_opened();
}

void LifecycleNode::stop_managed() {
  gate_->close();
  for (const auto& entity : managed()) entity->has_closed();
}

}  // namespace takt
