// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/wait_set.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "takt/programs/simulated_program.hpp"

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

// Adds to `members_` first: set_.add() may wake the waiting thread, which looks for the entity
// there.
void WaitSetCore::add(Member member) {
  const auto entity = member.entity;
  const auto object = member.object;
  {
    const std::lock_guard lock(mutex_);
    members_.push_back(std::move(member));
  }
  try {
    set_.add(entity);
  } catch (const takt::Error& error) {
    const Member refused = take(object);
    throw std::runtime_error("entity already associated with a wait set: " +
                             std::string(error.what()));
  }
}
void WaitSetCore::remove(const std::shared_ptr<const void>& object) {
  const Member removed = take(object);
  if (removed.entity == nullptr) throw std::runtime_error("entity not in wait set");
  set_.remove(removed.entity);
}
WaitSetCore::Member WaitSetCore::take(const std::shared_ptr<const void>& object) {
  Member taken{};
  const std::lock_guard lock(mutex_);
  // Searches from the end: an entity refused because it was added twice is also nearer the front.
  const auto found = std::find_if(members_.rbegin(), members_.rend(),
                                  [&](const Member& member) { return member.object == object; });
  if (found == members_.rend()) return taken;
  taken = std::move(*found);
  members_.erase(std::next(found).base());
  return taken;
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
        takt::Slot slot;  // one trigger ends one wait
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
  takt::programs::refuse("waits with a WaitSet");
  if (!context_->is_valid()) return WaitResultKind::Timeout;
  const auto& ready = set_.wait(timeout);
  collect(ready);
  takt::Slot slot;
  const bool is_stopped = stop_->take(slot);
  return ready.size() > (is_stopped ? 1u : 0u) ? WaitResultKind::Ready : WaitResultKind::Timeout;
}

}  // namespace rclcpp::detail
