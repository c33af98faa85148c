// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_set.hpp"

#include <algorithm>
#include <mutex>

#include "takt/base/error.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {

struct WaitSet::Member final : Sink {
  Member(WaitSet& set, std::shared_ptr<Entity> member) : wait_set(set), entity(std::move(member)) {}
  WaitSet& wait_set;
  const std::shared_ptr<Entity> entity;

  void announce(const Arrival&) noexcept override { wait_set.wake(); }
  void release_changed() noexcept override { wait_set.wake(); }
  bool wants_time() const noexcept override { return false; }
  void expect_remove() noexcept override {
    expect_wait();
    entity->add_earlier_owner(*this);
  }
  void remove() noexcept override {
    wait_set.expel(*this);
    end_use();
  }
  void expect_wait() noexcept override {
    wait_set.expected_removals_.fetch_add(1);
    users.fetch_add(1);
  }
  void wait_for_removal() noexcept override {
    expelled.wait(0);
    end_use();
  }
  bool is_detached() const noexcept override { return expelled.load() != 0; }

  std::atomic<std::uint32_t> expelled{0};

 private:
  // The last user frees the member. The set outlives that, as its destructor waits.
  void end_use() noexcept {
    WaitSet& set = wait_set;
    if (users.fetch_sub(1) == 1) delete this;
    if (set.expected_removals_.fetch_sub(1) == 1) set.expected_removals_.notify_all();
  }
  std::atomic<int> users{0};  // threads that remove it, or wait until it is removed
};

WaitSet::WaitSet(Clock& clock)
    : clock_(clock), backend_(make_wait_backend(kAutoWait, clock, 1, true)) {
}

WaitSet::~WaitSet() {
  std::vector<std::shared_ptr<Entity>> entities;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& member : members_) entities.push_back(member->entity);
  }
  for (const auto& entity : entities) remove(entity);
  // Other threads may be removing a member: they use the set until they have finished.
  for (std::size_t left; (left = expected_removals_.load()) != 0;) expected_removals_.wait(left);
  backend_->leave(0);
}

void WaitSet::wake() noexcept {
  sleeper_.wake([this] { backend_->post(); });
}

void WaitSet::add(const std::shared_ptr<Entity>& entity) {
  auto member = std::make_unique<Member>(*this, entity);
  const std::lock_guard lock(mutex_);
  {
    const std::lock_guard ownership(ownership_mutex());
    if (!entity->is_free()) {
      throw Error("'" + entity->name() + "' belongs to an executor or wait set already",
                  "create it in a callback group with automatically_add_to_executor = false");
    }
    entity->set_owner(member.get());
  }
  members_.push_back(std::move(member));
  // The caller may be reading what wait has returned: the next wait uses this vector instead.
  if (larger_.capacity() < members_.size()) {
    std::vector<std::shared_ptr<Entity>> larger;
    larger.reserve(2 * members_.size());
    larger_.swap(larger);
  }
  entity->attach(*members_.back());
  try {
    if (const Watch watch = entity->watch(); watch.fd >= 0) backend_->watch(watch);
  } catch (...) {
    {
      const std::lock_guard ownership(ownership_mutex());
      // A thread that has dropped the entity meanwhile waits for the mutex, and removes it.
      if (entity->owner() != members_.back().get()) throw;
      entity->set_owner(nullptr);
    }
    entity->detach();
    members_.pop_back();
    throw;
  }
  wake();  // it may be ready, or due sooner than what the thread waits for
}

void WaitSet::remove(const std::shared_ptr<Entity>& entity) {
  entity->leave_owner();
}

// Afterwards the users of the member own it. It leaves the list first, under the mutex, because the
// thread that adds it may not have attached it yet.
void WaitSet::expel(Member& member) noexcept {
  {
    const std::lock_guard lock(mutex_);
    const auto known = std::find_if(members_.begin(), members_.end(),
                                    [&](const auto& entry) { return entry.get() == &member; });
    [[maybe_unused]] const Member* const users_own_it = known->release();
    members_.erase(known);
  }
  if (const Watch watch = member.entity->watch(); watch.fd >= 0) backend_->unwatch(watch.listener);
  member.entity->detach();
  {
    const std::lock_guard ownership(ownership_mutex());
    member.entity->forget_earlier_owner(member);  // from here on no thread begins to wait
  }
  wake();  // the waiting thread may sleep until its release
  member.expelled.store(1);
  member.expelled.notify_all();
}

void WaitSet::collect() {
  ready_.clear();  // before the lock: this may destroy an entity, and what its user owns
  const std::lock_guard lock(mutex_);
  if (ready_.capacity() < members_.size()) ready_.swap(larger_);
  for (const auto& member : members_) {
    if (member->entity->ready_count() != 0) ready_.push_back(member->entity);
  }
}

const std::vector<std::shared_ptr<Entity>>& WaitSet::wait(Nanoseconds timeout) {
  const TimePoint limit = end_of(timeout, clock_.now());
  for (;;) {
    sleeper_.begin();  // before we look: what comes later wakes us
    collect();
    if (!ready_.empty() || clock_.now() >= limit) {
      sleeper_.end(false);
      return ready_;
    }
    TimePoint deadline = limit;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& member : members_) {
        deadline = std::min(deadline, member->entity->next_release().value_or(kNever));
      }
    }
    wake_up_on_time();
    sleeper_.end(backend_->wait(0, deadline));
  }
}

}  // namespace takt
