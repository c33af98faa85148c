// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/wait_set.hpp"

#include <algorithm>
#include <utility>

namespace rclcpp::detail {

WaitSetCore::WaitSetCore(Context::SharedPtr context)
    : context_(std::move(context)),
      stop_(std::make_shared<takt::GuardCondition>("shutdown", nullptr, takt::Clock::steady(),
                                                   std::function<void()>())) {
  set_.add(stop_);
  context_->add_waiter(*this);
}
WaitSetCore::~WaitSetCore() {
  context_->remove_waiter(*this);
}

void WaitSetCore::add(Member member) {
  try {
    set_.add(member.entity);
  } catch (const takt::Error& error) {
    throw std::runtime_error("entity already associated with a wait set: " +
                             std::string(error.what()));
  }
  const std::lock_guard lock(mutex_);
  members_.push_back(std::move(member));
}
void WaitSetCore::remove(const std::shared_ptr<const void>& object) {
  Member removed;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(members_.begin(), members_.end(),
                                    [&](const Member& member) { return member.object == object; });
    if (found == members_.end()) throw std::runtime_error("entity not in wait set");
    removed = std::move(*found);
    members_.erase(found);
  }
  set_.remove(removed.entity);
}

void WaitSetCore::collect(const std::vector<std::shared_ptr<takt::Entity>>& ready) {
  const std::lock_guard lock(mutex_);
  ready_ = {};
  for (const Member& member : members_) {
    const bool is_ready = std::find(ready.begin(), ready.end(), member.entity) != ready.end();
    std::pair<std::vector<const void*>*, std::size_t*> list;
    switch (member.kind) {
      case Kind::subscription:
        list = {&ready_.subscriptions, &ready_.size_of_subscriptions};
        break;
      case Kind::guard_condition: {
        list = {&ready_.guard_conditions, &ready_.size_of_guard_conditions};
        takt::Slot slot;  // one trigger is one wait
        if (is_ready) member.entity->take(slot);
        break;
      }
      case Kind::timer:
        list = {&ready_.timers, &ready_.size_of_timers};
        break;
      case Kind::client:
        list = {&ready_.clients, &ready_.size_of_clients};
        break;
      case Kind::service:
        list = {&ready_.services, &ready_.size_of_services};
        break;
    }
    list.first->push_back(is_ready ? member.object.get() : nullptr);
    ++*list.second;
  }
}

WaitResultKind WaitSetCore::wait(std::chrono::nanoseconds timeout) {
  {
    const std::lock_guard lock(mutex_);
    if (members_.empty()) return WaitResultKind::Empty;
  }
  if (!context_->is_valid()) return WaitResultKind::Timeout;
  const auto& ready = set_.wait(timeout);
  collect(ready);
  takt::Slot slot;
  const bool is_stopped = stop_->take(slot);
  return ready.size() > (is_stopped ? 1u : 0u) ? WaitResultKind::Ready : WaitResultKind::Timeout;
}

}  // namespace rclcpp::detail
