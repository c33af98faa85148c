// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_set.hpp"

#include <algorithm>
#include <mutex>

#include "takt/base/error.hpp"

namespace takt {

struct WaitSet::Member final : Sink {
  Member(WaitSet& set, std::shared_ptr<Entity> member) : wait_set(set), entity(std::move(member)) {}
  WaitSet& wait_set;
  const std::shared_ptr<Entity> entity;

  void announce(const Arrival&) noexcept override { wake(); }
  void release_changed() noexcept override { wake(); }
  void wake() noexcept {
    if (!wait_set.has_news_.exchange(true)) wait_set.backend_->post();
  }
  bool wants_time() const noexcept override { return false; }
  void expect_remove() noexcept override {}
  void remove() noexcept override { wait_set.expel(*this); }
};

WaitSet::WaitSet(Clock& clock) : clock_(clock), backend_(make_wait_backend(clock, 1)) {
}

WaitSet::~WaitSet() {
  while (!members_.empty()) remove(members_.back()->entity);
  backend_->leave(0);
}

void WaitSet::add(const std::shared_ptr<Entity>& entity) {
  auto member = std::make_unique<Member>(*this, entity);
  const std::lock_guard lock(mutex_);
  {
    const std::lock_guard ownership(ownership_mutex());
    if (entity->owner() != nullptr) {
      throw Error("'" + entity->name() + "' belongs to an executor or wait set already",
                  "create it in a callback group with automatically_add_to_executor = false");
    }
    entity->set_owner(member.get());
  }
  members_.push_back(std::move(member));
  ready_.reserve(members_.size());
  entity->attach(*members_.back());
}

void WaitSet::remove(const std::shared_ptr<Entity>& entity) {
  entity->Entity::retire();
}

void WaitSet::expel(Member& member) noexcept {
  member.entity->detach();
  const std::lock_guard lock(mutex_);
  std::erase_if(members_, [&](const auto& known) { return known.get() == &member; });
}

void WaitSet::collect() {
  const std::lock_guard lock(mutex_);
  ready_.clear();
  for (const auto& member : members_) {
    if (member->entity->ready_count() != 0) ready_.push_back(member->entity.get());
  }
}

const std::vector<Entity*>& WaitSet::wait(Nanoseconds timeout) {
  const TimePoint limit = timeout < Nanoseconds::zero() ? kNever : clock_.now() + timeout;
  for (;;) {
    has_news_.store(false);  // before we look: who comes later announces again
    collect();
    if (!ready_.empty() || clock_.now() >= limit) return ready_;
    TimePoint deadline = limit;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& member : members_) {
        deadline = std::min(deadline, member->entity->next_release().value_or(kNever));
      }
    }
    backend_->wait(0, deadline);
  }
}

}  // namespace takt
