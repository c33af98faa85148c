// Removing callbacks from an executor, with the threads that wait for it.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/same_owner.hpp"
#include "takt/executors/engine/callbacks.hpp"

namespace takt::detail {

void Callbacks::remove_node(const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!node->belongs_to(this)) {
    throw Error("node '" + node->fully_qualified_name() + "' does not belong to executor '" +
                options_.name + "'");
  }
  forget(*node);
  release_groups(node->groups(), *node, /*with_node=*/true);
}

void Callbacks::forget(Node& node) noexcept {
  node.remove_listener(*this);
  const std::lock_guard lock(lists_.mutex);
  std::erase_if(nodes_, [gone = node.weak_from_this()](const auto& known) {
    return is_same_owner(known, gone);
  });
}

void Callbacks::remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                      const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!group->belongs_to(this)) {
    throw Error(fmt::format("callback group '{}' of node '{}' does not belong to executor '{}'",
                            group->name(), node->fully_qualified_name(), options_.name));
  }
  release_groups({group}, *node);
}

// With one update. Waits for callbacks that another thread is already removing.
void Callbacks::release_groups(std::vector<std::shared_ptr<CallbackGroup>> groups, Node& node,
                               bool with_node) noexcept {
  const auto is_meant = [&](const Record& record) {
    return std::find(groups.begin(), groups.end(), record.group) != groups.end();
  };
  std::vector<std::shared_ptr<Entity>> entities;
  std::vector<Record*> mine;
  std::vector<Record*> of_others;
  std::vector<std::uint64_t> removals;
  {
    const std::lock_guard lock(lists_.mutex);
    std::erase_if(groups, [this](const auto& group) { return !group->belongs_to(this); });
    for (const auto& group : groups) removals.push_back(removals_.begin(group.get()));
    if (with_node) removals.push_back(removals_.begin(&node));
    entities = node.entities();  // from here on nothing is added to the groups
    for (const auto& entity : entities) {
      const auto known = of_entity_.find(entity.get());
      if (known == of_entity_.end() || !is_meant(*known->second)) continue;
      (claim_removal(*known->second) ? mine : of_others).push_back(known->second);
    }
    for (const auto& record : lists_.removed) {
      if (is_meant(*record)) of_others.push_back(record.get());
    }
    for (Record* record : of_others) record->state.retain();
  }
  remove(mine);
  for (Record* record : of_others) {
    record->wait_until_over();
    record->detach();
  }
  const std::lock_guard lock(lists_.mutex);
  for (Record* record : of_others) record->state.release();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (removals_.end(groups[i].get(), removals[i])) groups[i]->release(this);
  }
  if (with_node && removals_.end(&node, removals.back())) node.release(this);
}

// Returns true if the caller, and no other thread, removes the record.
bool Callbacks::claim_removal(Record& record) noexcept {
  const std::lock_guard ownership(ownership_mutex());
  if (record.entity->owner() != &record) return false;  // another thread removes it
  record.entity->set_owner(nullptr);
  record.expect_remove();
  return true;
}

// 1. The records leave the list, so that the next update does not contain them. Their file
//    descriptors are no longer watched.
// 2. A dispatch point installs that update, or this thread does, if none spins: the records leave
//    the scheduler.
// 3. The running callbacks end; then no thread executes the entities.
// 4. The entities drop their sinks; when all read sections have ended, no thread announces them.
// 5. A record without references is freed: neither these threads nor the ready set use it.
//
// If this thread holds a mutex for which a running callback waits, waiting here is a deadlock. So a
// helper thread completes a removal that takes too long; the executor's destructor waits for that.
void Callbacks::remove(const std::vector<Record*>& records, Nanoseconds at_most) noexcept {
  if (records.empty()) return;
  begin_removal(records);
  const auto end = [this, records] {
    for (const Record* record : records) record->wait_until_over();
    end_removal(records);
  };
  const bool is_over = std::all_of(records.begin(), records.end(), [&](const Record* record) {
    return record->wait_until_over(at_most);
  });
  if (is_over) return end();
  try {
    std::thread(end).detach();
  } catch (const std::system_error&) {  // the system has no thread left
    end();
  }
}

void Callbacks::begin_removal(const std::vector<Record*>& records) noexcept {
  const std::lock_guard lock(lists_.mutex);
  std::vector<Record*> handed_over;
  for (Record* record : records) {
    take_from_lists(*record);
    if (record->is_handed_over) {
      handed_over.push_back(record);
    } else {
      record->remove_unpublished();
    }
  }
  if (handed_over.empty()) return;
  changes_.publish_removal(handed_over, lists_.records);
  if (!lists_.is_spinning) dispatcher_.install_here();
}

void Callbacks::end_removal(const std::vector<Record*>& records) noexcept {
  for (Record* record : records) record->detach();
  RemovedRecords gone;
  {
    const std::lock_guard lock(lists_.mutex);
    for (Record* record : records) record->state.release();
    if (!lists_.is_spinning) {  // so no worker empties the inbox
      const std::lock_guard dispatch(dispatcher_.lock());
      dispatcher_.ready().discard_removed();
    }
    gone = take_unused();
  }
  gone.clear();
  removals_.are_over(records.size());
}

void Callbacks::take_from_lists(Record& record) noexcept {
  const auto entry = lists_.records.find(record.key());
  if (entry == lists_.records.end()) return;  // see undo_add
  dispatcher_.workers().places().unwatch(record);
  of_entity_.erase(record.entity.get());
  lists_.removed.push_back(std::move(entry->second));
  lists_.records.erase(entry);
  record.state.release();
}

// The caller destroys the records after it has released the mutex: a user's callback is destroyed
// with its record, and may hold another entity of this executor.
RemovedRecords Callbacks::take_unused() noexcept {
  dispatcher_.updates().free_used();
  RemovedRecords gone;
  for (auto& record : lists_.removed) {
    if (!record->may_be_freed()) continue;
    dispatcher_.observation().remember(*record);
    gone.push_back(std::move(record));
  }
  std::erase(lists_.removed, nullptr);
  return gone;
}

}  // namespace takt::detail
