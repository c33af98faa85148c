// One callback of each group in turn; inside a group, order of arrival. So no group, however
// busy, makes another wait for more than one callback of each group.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

class RoundRobinScheduler final : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo> callbacks) override {
    GroupId last_group = 0;
    for (const CallbackInfo& callback : callbacks) {
      last_group = std::max(last_group, callback.group);
    }
    groups_.resize(last_group + 1);
  }

  void push(ReadyCallback& callback) noexcept override {
    Group& group = groups_[callback.info->group];
    const bool was_empty = group.first == nullptr;
    insert(group, callback);
    if (was_empty) append(group);
  }

  ReadyCallback* pop() noexcept override {
    Group* group = first_turn_;
    if (group == nullptr) return nullptr;
    first_turn_ = group->next_turn;
    if (first_turn_ == nullptr) last_turn_ = nullptr;
    ReadyCallback* callback = group->first;
    group->first = callback->next;
    if (group->first != nullptr) append(*group);
    return callback;
  }
  ReadyCallback* peek() noexcept override {
    return first_turn_ != nullptr ? first_turn_->first : nullptr;
  }

 private:
  struct Group {
    ReadyCallback* first = nullptr;  // by arrival, linked by `next`
    Group* next_turn = nullptr;
  };

  // Linear in what the group has ready, which its number of callbacks bounds. A callback that
  // comes back with an older message goes before those that arrived later.
  static void insert(Group& group, ReadyCallback& callback) noexcept {
    ReadyCallback** place = &group.first;
    while (*place != nullptr && (*place)->sequence < callback.sequence) place = &(*place)->next;
    callback.next = *place;
    *place = &callback;
  }

  void append(Group& group) noexcept {
    group.next_turn = nullptr;
    (last_turn_ == nullptr ? first_turn_ : last_turn_->next_turn) = &group;
    last_turn_ = &group;
  }

  std::vector<Group> groups_;
  Group* first_turn_ = nullptr;
  Group* last_turn_ = nullptr;
};

}  // namespace
TAKT_REGISTER_SCHEDULER("round_robin", "one callback of each group in turn", RoundRobinScheduler,
                        .uses_time = false, .order = analysis::Order::in_turns)
}  // namespace takt
