// Removing callbacks from an executor, with the threads that wait for it.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
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
  const std::lock_guard lock(mutex_);
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
    const std::lock_guard lock(mutex_);
    std::erase_if(groups, [this](const auto& group) { return !group->belongs_to(this); });
    for (const auto& group : groups) removals.push_back(removals_.begin(group.get()));
    if (with_node) removals.push_back(removals_.begin(&node));
    entities = node.entities();  // from here on nothing is added to the groups
    for (const auto& entity : entities) {
      const auto known = of_entity_.find(entity.get());
      if (known == of_entity_.end() || !is_meant(*known->second)) continue;
      (claim_removal(*known->second) ? mine : of_others).push_back(known->second);
    }
    for (const auto& record : removed_) {
      if (is_meant(*record)) of_others.push_back(record.get());
    }
    for (Record* record : of_others) record->state.retain();
  }
  remove(mine);
  for (Record* record : of_others) {
    record->wait_until_over();
    record->detach();
  }
  const std::lock_guard lock(mutex_);
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
// 2. A dispatch point installs that update: it takes them out of the scheduler.
// 3. The running callbacks end; then no thread executes the entities.
// 4. The entities drop their sinks; when all read sections have ended, no thread announces them.
// 5. A record without references is freed: neither these threads nor the ready set use it.
void Callbacks::remove(const std::vector<Record*>& records) noexcept {
  if (records.empty()) return;
  const bool at_rest = begin_removal(records);
  for (const Record* record : records) record->wait_until_over();
  end_removal(records, at_rest);
}

// A thread that holds a mutex which a callback waits for would wait for ever. So another one ends
// what takes too long; the executor's destructor waits for it.
void Callbacks::remove_dropped(Record& record) noexcept {
  const Nanoseconds at_most = record.entity->drop_wait();
  if (at_most == Nanoseconds::max()) return remove({&record});
  const bool at_rest = begin_removal({&record});
  if (record.wait_until_over(at_most)) return end_removal({&record}, at_rest);
  const auto end = [this, &record, at_rest] {
    record.state.wait_until_over();
    end_removal({&record}, at_rest);
  };
  try {
    std::thread(end).detach();
  } catch (const std::system_error&) {  // no thread is to be had
    end();
  }
}

/// Returns true if no thread spins, so that none executes.
bool Callbacks::begin_removal(const std::vector<Record*>& records) noexcept {
  const std::lock_guard lock(mutex_);
  const bool at_rest = !is_spinning_;
  for (Record* record : records) take_from_lists(*record);
  if (at_rest) {
    remove_at_rest(records);
  } else {
    publish_removal();
  }
  return at_rest;
}

void Callbacks::end_removal(const std::vector<Record*>& records, bool at_rest) noexcept {
  for (Record* record : records) record->detach();
  // Destroy what the user's callbacks hold without the lock: it may be another entity of this
  // executor.
  std::vector<std::shared_ptr<Entity>> released;
  RemovedRecords gone;
  {
    const std::lock_guard lock(mutex_);
    for (Record* record : records) {
      if (at_rest) {
        dispatcher_.observation().remember(*record);
        released.push_back(record->release_entity());
      }
      record->state.release();
    }
    if (!at_rest || changes_.count_removed() == 0) gone = take_unused();
  }
  released.clear();
  gone.clear();
  removals_.are_over(records.size());
}

void Callbacks::take_from_lists(Record& record) noexcept {
  const auto entry = records_.find(record.key());
  if (entry == records_.end()) return;  // see undo_add
  dispatcher_.workers().places().unwatch(record);
  of_entity_.erase(record.entity.get());
  removed_.push_back(std::move(entry->second));
  records_.erase(entry);
  record.state.release();
  if (record.is_handed_over) {
    changes_.removed(record);
  } else {
    record.remove_at_rest();
  }
}

// While no thread spins, so none executes. The ready set drops the records at the next spin, or
// when there are many of them: so removing n callbacks costs O(n log n).
void Callbacks::remove_at_rest(const std::vector<Record*>& records) noexcept {
  for (Record* record : records) record->remove_at_rest();
  if (changes_.count_removed() <= records_.size()) return;
  try {
    publish();
    dispatcher_.install_here();
  } catch (...) {  // a user's scheduler threw: the next spin reports it
  }
}

// The caller destroys the records after it has released the mutex: a user's callback is destroyed
// with its record, and may hold another entity of this executor.
RemovedRecords Callbacks::take_unused() noexcept {
  dispatcher_.updates().free_used();
  RemovedRecords gone;
  for (auto& record : removed_) {
    if (!record->may_be_freed()) continue;
    if (record->entity != nullptr) dispatcher_.observation().remember(*record);
    gone.push_back(std::move(record));
  }
  std::erase(removed_, nullptr);
  return gone;
}

}  // namespace takt::detail
