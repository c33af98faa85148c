// SPDX-License-Identifier: Apache-2.0
#include "rclcpp_lifecycle/lifecycle_node.hpp"

#include <algorithm>
#include <array>
#include <atomic>

namespace rclcpp_lifecycle {
namespace {

/// The State with this id; never destroyed, as callers keep references.
const State& state_of(takt::LifecycleState state) {
  static const auto* states = [] {
    auto* all = new std::array<State, 256>;
    for (const takt::LifecycleState known : takt::lifecycle_states()) {
      const auto id = static_cast<std::uint8_t>(known);
      (*all)[id] = State(id, std::string(takt::label(known)));
    }
    return all;
  }();
  return (*states)[static_cast<std::uint8_t>(state)];
}

std::vector<Transition> to_list(std::span<const takt::LifecycleTransition> transitions) {
  std::vector<Transition> list;
  for (const takt::LifecycleTransition& transition : transitions) {
    list.emplace_back(static_cast<std::uint8_t>(transition.id), std::string(transition.label),
                      State(state_of(transition.start)), State(state_of(transition.goal)));
  }
  return list;
}

}  // namespace

/// Takt's lifecycle node; forwards each transition callback to the rclcpp node that owns it.
class LifecycleNode::Machine final : public takt::LifecycleNode {
 public:
  using takt::LifecycleNode::LifecycleNode;
  std::atomic<rclcpp_lifecycle::LifecycleNode*> owner{nullptr};

 private:
  using During = takt::LifecycleState;
  using Returned = takt::CallbackReturn;
  Returned call(During during, During previous) {
    auto* const user = owner.load();
    return user != nullptr ? user->call(during, previous) : Returned::FAILURE;
  }
  Returned on_configure(During previous) override { return call(During::configuring, previous); }
  Returned on_cleanup(During previous) override { return call(During::cleaningup, previous); }
  Returned on_activate(During previous) override { return call(During::activating, previous); }
  Returned on_deactivate(During previous) override { return call(During::deactivating, previous); }
  Returned on_shutdown(During previous) override { return call(During::shuttingdown, previous); }
  Returned on_error(During previous) override { return call(During::errorprocessing, previous); }
};

LifecycleNode::LifecycleNode(const std::string& name, const std::string& name_space,
                             const rclcpp::NodeOptions& options,
                             bool enable_communication_interface)
    : NodeApi(name, name_space, options,
              [](const std::string& in_code, const takt::NodeOptions& how) {
                return std::make_shared<Machine>(in_code, how);
              }),
      machine_(static_cast<Machine*>(get_node_base_interface()->takt_node().get())) {
  machine_->owner.store(this);
  const bool is_served = options.takt().has_value();  // by the container
  if (enable_communication_interface && !is_served) {
    services_ = std::make_unique<takt::LifecycleServices>(*machine_, *machine_);
  }
}
LifecycleNode::~LifecycleNode() {
  services_.reset();
  machine_->owner.store(nullptr);
}

void LifecycleNode::add_managed_entity(std::weak_ptr<ManagedEntityInterface> entity) {
  const std::lock_guard lock(mutex_);
  std::erase_if(managed_, [](const auto& known) { return known.expired(); });
  managed_.push_back(std::move(entity));
}
// Locks one entity at a time: the callback of one may drop another.
template <class Use>
void LifecycleNode::each_managed(Use&& use) {
  std::vector<std::weak_ptr<ManagedEntityInterface>> entities;
  {
    const std::lock_guard lock(mutex_);
    entities = managed_;
  }
  for (const auto& weak : entities) {
    if (const auto entity = weak.lock()) use(*entity);
  }
}
LifecycleNode::CallbackReturn LifecycleNode::on_activate(const State&) {
  each_managed([](ManagedEntityInterface& entity) { entity.on_activate(); });
  return CallbackReturn::SUCCESS;
}
LifecycleNode::CallbackReturn LifecycleNode::on_deactivate(const State&) {
  each_managed([](ManagedEntityInterface& entity) { entity.on_deactivate(); });
  return CallbackReturn::SUCCESS;
}

const State& LifecycleNode::get_current_state() const {
  return state_of(machine_->get_current_state());
}
std::vector<State> LifecycleNode::get_available_states() const {
  std::vector<State> states;
  for (const auto state : takt::lifecycle_states()) states.push_back(state_of(state));
  return states;
}
std::vector<Transition> LifecycleNode::get_available_transitions() const {
  return to_list(takt::lifecycle_transitions(machine_->get_current_state()));
}
std::vector<Transition> LifecycleNode::get_transition_graph() const {
  return to_list(takt::lifecycle_transitions());
}

const State& LifecycleNode::result(const takt::TransitionResult& result, CallbackReturn* returned) {
  if (!result) RCLCPP_ERROR(get_logger(), "%s", result.message.c_str());
  if (returned != nullptr) *returned = result.returned.value_or(CallbackReturn::FAILURE);
  return state_of(result.state);
}
const State& LifecycleNode::trigger_transition(std::uint8_t id) {
  return result(machine_->trigger_transition(static_cast<takt::TransitionId>(id)), nullptr);
}
const State& LifecycleNode::trigger_transition(std::uint8_t id, CallbackReturn& returned) {
  return result(machine_->trigger_transition(static_cast<takt::TransitionId>(id)), &returned);
}
const State& LifecycleNode::request(const char* label, CallbackReturn* returned) {
  return result(machine_->trigger_transition(label), returned);
}

bool LifecycleNode::register_callback(takt::LifecycleState during, Callback::Function callback) {
  auto added = std::make_shared<Callback>(std::move(callback));
  {
    const std::lock_guard lock(mutex_);
    callbacks_[during].swap(added);
  }
  if (added != nullptr) added->remove();  // the callback registered before
  return true;
}
LifecycleNode::CallbackReturn LifecycleNode::call(takt::LifecycleState during,
                                                  takt::LifecycleState previous) {
  const State& state = state_of(previous);
  for (;;) {
    std::shared_ptr<Callback> registered;
    {
      const std::lock_guard lock(mutex_);
      if (const auto found = callbacks_.find(during); found != callbacks_.end()) {
        registered = found->second;
      }
    }
    if (registered == nullptr) break;
    auto returned = CallbackReturn::FAILURE;
    if (registered->call([&](const auto& callback) { returned = callback(state); })) {
      return returned;
    }  // replaced meanwhile
  }
  switch (during) {
    case takt::LifecycleState::configuring:
      return on_configure(state);
    case takt::LifecycleState::cleaningup:
      return on_cleanup(state);
    case takt::LifecycleState::activating:
      return on_activate(state);
    case takt::LifecycleState::deactivating:
      return on_deactivate(state);
    case takt::LifecycleState::shuttingdown:
      return on_shutdown(state);
    default:
      return on_error(state);
  }
}

}  // namespace rclcpp_lifecycle
