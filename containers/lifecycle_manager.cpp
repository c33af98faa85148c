// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/lifecycle_manager.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "takt/base/logger.hpp"
#include "takt/base/same_owner.hpp"
#include "takt/messages/lifecycle_msgs/srv/change_state.hpp"

namespace takt {
namespace {

using lifecycle_msgs::srv::ChangeState;

constexpr const char* kTopic = "/takt/heartbeat";
constexpr std::size_t kDepth = 100;  // heartbeats that may arrive at the same time
// If a process restarts so fast that its loss is not noticed, its response never arrives.
constexpr Nanoseconds kTimeout = std::chrono::seconds(30);

}  // namespace

// ---- Heartbeats ----

HeartbeatSender::HeartbeatSender(Node& host, Nanoseconds heartbeat)
    : publisher_(host.create_publisher<Heartbeat>(kTopic, kDepth)),
      timer_(host.create_timer("heartbeat", heartbeat / 3, [this] { send(); })) {
  // Send the first heartbeat at once: the manager waits for it before it brings the node up.
  timer_->release_at(host.clock().now());
}

std::shared_ptr<void> HeartbeatSender::add(const std::shared_ptr<LifecycleNode>& node) {
  const std::lock_guard lock(mutex_);
  std::erase_if(nodes_, [](const auto& known) { return known.expired(); });
  nodes_.push_back(node);
  return {nullptr, [this, gone = std::weak_ptr<LifecycleNode>(node)](void*) {
            const std::lock_guard guard(mutex_);
            std::erase_if(nodes_, [&](const auto& known) { return is_same_owner(known, gone); });
          }};
}

void HeartbeatSender::send() {
  const std::lock_guard lock(mutex_);
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      publisher_->publish(std::make_unique<Heartbeat>(Heartbeat{
          node->fully_qualified_name(), static_cast<std::uint8_t>(node->get_current_state())}));
    }
  }
}

// ---- The manager ----

struct LifecycleManager::Managed {
  std::string name;
  std::vector<std::string> depends_on;
  std::shared_ptr<Client<ChangeState>> client;
  LifecycleState state = LifecycleState::unknown;
  TimePoint heard{}, answered{};
  std::uint64_t call = 0;   // the number of the last request
  std::string failed_at;    // the transition that it failed or refused
  bool was_heard = false;   // it has sent a heartbeat
  bool is_asked = false;    // the last request has no response yet
  bool is_lost = false;     // its heartbeats stopped
  bool has_failed = false;  // it failed or refused a transition
  bool was_up = false;      // if it is inactive now, another client deactivated it: leave it alone
  bool waits = false;       // deactivated until the nodes that it depends on are active

  /// Whether the manager can continue with the next node in the order: not where the bring-up has
  /// failed.
  bool is_settled() const {
    return state == LifecycleState::active || (was_up && (is_lost || has_failed || !waits));
  }
  bool is_down() const { return state == LifecycleState::finalized || is_lost || has_failed; }
};

LifecycleManager::LifecycleManager(Node& host, const LifecycleDescription& description)
    : description_(description), clock_(host.clock()) {
  for (const auto& node : description.bring_up) {
    nodes_.push_back(std::make_unique<Managed>());
    nodes_.back()->name = node.name;
    nodes_.back()->depends_on = node.depends_on;
    nodes_.back()->client =
        host.create_client<ChangeState>(node.name + "/change_state", {.timeout = kTimeout});
  }
  heartbeats_ = host.create_subscription<Heartbeat>(
      kTopic, kDepth, [this](const Heartbeat& heartbeat) { heard(heartbeat); });
  watch_ = host.create_timer("watch", description.heartbeat / 4, [this] { look_for_lost(); });
}

LifecycleManager::~LifecycleManager() = default;

void LifecycleManager::bring_up() {
  const std::lock_guard lock(mutex_);
  target_ = Target::up;
  for (const auto& node : nodes_) node->heard = clock_.now();
  step();  // some heartbeats may have arrived already
}

std::vector<std::string> LifecycleManager::shut_down(Nanoseconds limit) {
  const auto all_down = [this] {
    return std::all_of(nodes_.begin(), nodes_.end(),
                       [](const auto& node) { return node->is_down(); });
  };
  std::unique_lock lock(mutex_);
  target_ = Target::down;
  for (const auto& node : nodes_) node->has_failed = false;
  step();
  changed_.wait_for(lock, limit, all_down);
  std::vector<std::string> left;
  for (const auto& node : nodes_) {
    if (node->state != LifecycleState::finalized) left.push_back(node->name);
  }
  return left;
}

std::vector<std::string> LifecycleManager::failures() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> failures;
  for (const auto& node : nodes_) {
    if (node->was_up || !(node->has_failed || node->is_lost)) continue;
    failures.push_back(node->has_failed
                           ? fmt::format("lifecycle: {} failed to {}; the bring-up stopped there",
                                         node->name, node->failed_at)
                           : fmt::format("lifecycle: {} {}; the bring-up stopped there", node->name,
                                         node->was_heard ? "was lost" : "was not found"));
    break;
  }
  return failures;
}

bool LifecycleManager::is_up() const {
  const std::lock_guard lock(mutex_);
  return std::all_of(nodes_.begin(), nodes_.end(),
                     [](const auto& node) { return node->state == LifecycleState::active; });
}

void LifecycleManager::heard(const Heartbeat& heartbeat) {
  const std::lock_guard lock(mutex_);
  for (const auto& node : nodes_) {
    if (node->name != heartbeat.node) continue;
    node->heard = clock_.now();
    node->was_heard = true;
    if (std::exchange(node->is_lost, false)) {
      log(LogLevel::warn, "lifecycle: {} is back", node->name);
      node->was_up = node->has_failed = false;  // bring it up again
    }
    // While a request waits for its response, heartbeats may be older than the transition.
    const bool may_be_old = clock_.now() - node->answered < description_.heartbeat / 3;
    if (!node->is_asked && !may_be_old) node->state = static_cast<LifecycleState>(heartbeat.state);
    node->was_up |= node->state == LifecycleState::active;
  }
  step();
}

void LifecycleManager::look_for_lost() {
  const std::lock_guard lock(mutex_);
  if (target_ == Target::none) return;
  for (const auto& node : nodes_) {
    if (node->is_lost || clock_.now() - node->heard <= description_.heartbeat) continue;
    node->is_lost = true;
    node->is_asked = false;
    node->state = LifecycleState::unknown;
    log(LogLevel::error, "lifecycle: {} is lost: no heartbeat for {} ms{}", node->name,
        description_.heartbeat / std::chrono::milliseconds(1),
        node->was_up ? "" : "; the bring-up stops there until it comes");
    if (description_.on_loss == LifecycleDescription::OnLoss::shutdown) target_ = Target::down;
  }
  step();
}

// Requests the transitions that are possible now. This and all functions below need the mutex.
void LifecycleManager::step() {
  if (target_ == Target::up) {
    for (const auto& node : nodes_) {
      step_up(*node);
      if (!node->is_settled()) break;
    }
    // Nodes later in the order may be up already, and need deactivation.
    for (const auto& node : nodes_) {
      if (node->state == LifecycleState::active && !may_be_active(*node)) step_up(*node);
    }
  } else if (target_ == Target::down) {
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
      step_down(**node);
      if (!(*node)->is_down()) break;
    }
  }
  changed_.notify_all();
}

const LifecycleManager::Managed& LifecycleManager::find(const std::string& name) const {
  return **std::find_if(nodes_.begin(), nodes_.end(),
                        [&](const auto& node) { return node->name == name; });
}

bool LifecycleManager::may_be_active(const Managed& node) const {
  return std::all_of(node.depends_on.begin(), node.depends_on.end(), [this](const auto& name) {
    return find(name).state == LifecycleState::active;
  });
}

void LifecycleManager::step_up(Managed& node) {
  if (node.is_asked || node.is_lost || node.has_failed) return;
  if (node.state == LifecycleState::unconfigured && !node.was_up) {
    ask(node, "configure");
  } else if (node.state == LifecycleState::inactive && (!node.was_up || node.waits)) {
    if (may_be_active(node)) ask(node, "activate");
  } else if (node.state == LifecycleState::active && !may_be_active(node) &&
             description_.on_loss == LifecycleDescription::OnLoss::deactivate_dependents) {
    node.waits = true;
    ask(node, "deactivate");
  }
}

void LifecycleManager::step_down(Managed& node) {
  if (node.is_asked || node.is_down()) return;
  if (node.state == LifecycleState::active) {
    ask(node, "deactivate");
  } else if (node.state == LifecycleState::inactive) {
    ask(node, "cleanup");
  } else if (node.state == LifecycleState::unconfigured) {
    ask(node, "shutdown");
  }
}

void LifecycleManager::ask(Managed& node, std::string_view transition) {
  if (!node.client->service_is_ready()) return;  // the next heartbeat tries again
  node.is_asked = true;
  const std::uint64_t call = ++node.call;
  log(LogLevel::info, "lifecycle: {} {}", transition, node.name);
  ChangeState::Request request;
  request.transition.label = transition;
  node.client->async_send_request(
      request, [this, &node, call, label = std::string(transition)](const auto* response) {
        const std::lock_guard lock(mutex_);
        if (!node.is_asked || node.call != call) return;  // the node was lost meanwhile
        node.is_asked = false;
        if (response == nullptr) {  // timed out: heartbeats will show its state
          log(LogLevel::warn, "lifecycle: {} has not answered for {} s: {}", node.name,
              kTimeout / std::chrono::seconds(1), label);
          return;
        }
        node.answered = clock_.now();
        if (!response->success) {
          node.has_failed = true;
          node.failed_at = label;
          log(LogLevel::error, "lifecycle: {} failed to {}{}", node.name, label,
              node.was_up || target_ != Target::up ? "" : "; the bring-up stops there");
        } else {
          node.state = label == "activate"   ? LifecycleState::active
                       : label == "cleanup"  ? LifecycleState::unconfigured
                       : label == "shutdown" ? LifecycleState::finalized
                                             : LifecycleState::inactive;
          if (label == "activate") node.was_up = true, node.waits = false;
        }
        step();
      });
}

}  // namespace takt
