// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/callbacks.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/same_owner.hpp"
#include "takt/entities/traced.hpp"
#include "takt/entities/wait_in_callback.hpp"

namespace takt::detail {

Callbacks::Callbacks(const ExecutorOptions& options, Dispatcher& dispatcher, CallbackLists& lists)
    : options_(options), dispatcher_(dispatcher), lists_(lists), changes_(dispatcher, options) {
  WaitInCallback::set_duty(Dispatcher::install_updates_here);
  trace_executor_made(this, dispatcher.workers().all().size());
}

Callbacks::~Callbacks() {
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) node->remove_listener(*this);
  }
  std::vector<Record*> mine;
  {
    const std::lock_guard lock(lists_.mutex);
    dispatcher_.observation().end();
    for (const auto& [id, record] : lists_.records) {
      if (claim_removal(*record)) mine.push_back(record.get());
    }
  }
  remove(mine);
  // Waits until no thread removes a callback or waits for a removal. None can begin to do so
  // afterwards: a thread that drops a handle later finds no record.
  for (bool is_over = false; !is_over;) {
    removals_.wait();
    const std::lock_guard lock(lists_.mutex);
    const std::lock_guard ownership(ownership_mutex());
    is_over = !removals_.are_expected();
    if (!is_over) continue;
    for (const auto& record : lists_.removed) record->forget_earlier_owner();
  }
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      for (const auto& group : node->groups()) group->release(this);
      node->release(this);
    }
  }
  dispatcher_.updates().take_back();
  take_unused();
}

// ---- Adding ----

void Callbacks::refuse_when_frozen(const char* what) const {
  const std::lock_guard lock(lists_.mutex);
  if (is_frozen_) {
    throw Error(fmt::format("executor '{}' is static: nothing can be {} after its first spin",
                            options_.name, what),
                "do it before, or choose 'single_threaded'");
  }
}

void Callbacks::add_node(const std::shared_ptr<Node>& node) {
  refuse_when_frozen("added");
  if (!node->claim(this)) {
    throw Error("node '" + node->fully_qualified_name() + "' belongs to an executor already",
                "remove it there first");
  }
  listen_to(node);
  try {
    for (const auto& group : node->groups()) {
      if (group->automatically_add_to_executor() && group->claim(this)) add_group(group, *node);
    }
  } catch (...) {
    remove_node(node);
    throw;
  }
  if (!node->belongs_to(this)) release_groups(node->groups(), *node);  // removed meanwhile
}

void Callbacks::add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                   const std::shared_ptr<Node>& node) {
  refuse_when_frozen("added");
  const auto groups = node->groups();
  if (std::find(groups.begin(), groups.end(), group) == groups.end()) {
    throw Error(fmt::format("callback group '{}' is not one of node '{}'", group->name(),
                            node->fully_qualified_name()));
  }
  if (!group->claim(this)) {
    throw Error(fmt::format("callback group '{}' of node '{}' belongs to an executor already",
                            group->name(), node->fully_qualified_name()),
                "remove it there first");
  }
  listen_to(node);
  try {
    add_group(group, *node);
  } catch (...) {
    release_groups({group}, *node);
    throw;
  }
}

void Callbacks::listen_to(const std::shared_ptr<Node>& node) {
  node->add_listener(*this);
  const std::lock_guard lock(lists_.mutex);
  const auto is_known = [&](const auto& known) { return is_same_owner(known, node); };
  if (std::any_of(nodes_.rbegin(), nodes_.rend(), is_known)) return;  // by another group
  if (nodes_.size() == nodes_.capacity()) {
    std::erase_if(nodes_, [](const auto& known) { return known.expired(); });
  }
  nodes_.push_back(node);
}

void Callbacks::add_group(const std::shared_ptr<CallbackGroup>& group, const Node& node) {
  for (const auto& entity : node.entities()) {
    if (entity->group() == group) add_entity(entity, node);
  }
}

void Callbacks::group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) {
  if (node.belongs_to(this) && group->automatically_add_to_executor()) group->claim(this);
}

void Callbacks::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  if (!entity->group()->belongs_to(this)) return;
  refuse_when_frozen("added");
  add_entity(entity, node);
}

std::unique_ptr<CallbackRecord> Callbacks::make_record(const std::shared_ptr<Entity>& entity,
                                                       const Node& node,
                                                       const CallbackParameters& parameters) {
  auto record = std::make_unique<Record>(*this, dispatcher_, entity, node, parameters);
  auto& known_node = node_ids_.of(&node);
  known_node.alive = node.weak_from_this();
  auto& group = group_ids_.of(record->group.get());
  record->exclusion = group.alive.lock();
  if (record->exclusion == nullptr) {
    record->exclusion = std::make_shared<Exclusion>(record->group->type());
    group.alive = record->exclusion;
    trace_group_added(this, *record->group);
  }
  const auto& order = options_.order;
  const auto listed = std::find_if(order.begin(), order.end(), [&](const std::string& name) {
    return named(*record, {}).is_called(name);
  });
  const auto place = static_cast<std::uint32_t>(listed - order.begin());
  record->wanted.info = {.id = next_id_,
                         .kind = entity->kind(),
                         .registration = place + (listed == order.end() ? next_id_ : 0),
                         .group = group.number,
                         .node = known_node.number};
  record->settings = record->wanted = settings_of(*record, node);
  ++next_id_;
  return record;
}

void Callbacks::add_entity(const std::shared_ptr<Entity>& entity, const Node& node) {
  // Destroyed after the lock is released, as they hold functions of the user.
  RemovedRecords gone;
  std::unique_ptr<Record> record;
  const CallbackParameters parameters = node.callback_parameters(*entity);
  const std::lock_guard lock(lists_.mutex);
  if (removals_.contains(entity->group().get())) return;  // as if created after the removal
  gone = take_unused();
  record = make_record(entity, node, parameters);
  {
    const std::lock_guard ownership(ownership_mutex());
    // The entity was found twice, in the node's list and as an added entity; or the user has
    // dropped it, and it is not destroyed yet.
    if (!entity->is_free() || entity->is_retired()) return;
    record->own_entity();
  }
  Record& added = *record;
  of_entity_.emplace(entity.get(), &added);
  lists_.records.emplace(added.key(), std::move(record));
  try {
    dispatcher_.workers().places().watch(added);
    changes_.added();
    if (lists_.is_spinning) publish();
  } catch (...) {  // a user's scheduler refuses it: undo all
    undo_add(added);
    throw;
  }
}

// If another thread has dropped the entity meanwhile, that thread waits for the mutex and completes
// the removal.
void Callbacks::undo_add(Record& record) noexcept {
  take_from_lists(record);
  record.remove_unpublished();
  {
    const std::lock_guard ownership(ownership_mutex());
    if (record.entity->owner() != &record) return;
    record.entity->set_owner(nullptr);
  }
  lists_.removed.pop_back();
}

// ---- Changing ----

void Callbacks::parameters_changed(Node& node) {
  const auto entities = node.entities();
  const std::lock_guard lock(lists_.mutex);
  std::vector<ScheduleUpdate::Change> changed;
  for (const auto& entity : entities) {
    const auto known = of_entity_.find(entity.get());
    if (known == of_entity_.end()) continue;
    Record& record = *known->second;
    if (const CallbackSettings now = settings_of(record, node); now != record.wanted)
      changed.push_back({&record, now});
  }
  const auto exchange = [&changed] {
    for (auto& [record, settings] : changed) {
      std::swap(record->wanted, settings);
      if (!record->is_handed_over) record->settings = record->wanted;
    }
  };
  exchange();
  if (std::none_of(changed.begin(), changed.end(),
                   [](const auto& change) { return change.record->is_handed_over; })) {
    return;  // the first spin publishes them
  }
  try {
    publish(changed);
  } catch (...) {  // a user's scheduler refuses them: undo all
    exchange();
    throw;
  }
}

// Throws what a user's scheduler throws; then nothing has changed.
void Callbacks::publish(const std::vector<ScheduleUpdate::Change>& changed) {
  changes_.publish(lists_.records, changed);
  group_ids_.forget_gone();
  node_ids_.forget_gone();
  if (!lists_.is_spinning) dispatcher_.install_here();
}

// ---- Spinning ----

void Callbacks::begin_spin(Worker& worker, bool freezes) {
  const std::lock_guard lock(lists_.mutex);
  if (lists_.is_spinning) {
    throw Error("executor '" + options_.name + "' is spinning already",
                "in a callback, make it a coroutine and co_await what it waits for");
  }
  if (!dispatcher_.workers().places().are_chosen()) choose_wait_backend();
  dispatcher_.workers().places().prepare();
  if (changes_.are_pending()) publish();
  lists_.is_spinning = true;
  is_frozen_ = freezes;
  worker.enter();
  const ReadSection registers_this_thread;
  dispatcher_.begin();
}

void Callbacks::end_spin(Worker& worker) noexcept {
  const std::lock_guard lock(lists_.mutex);
  dispatcher_.install_here();
  worker.leave();
  lists_.is_spinning = false;
}

void Callbacks::choose_wait_backend() {
  Places& places = dispatcher_.workers().places();
  places.choose(std::any_of(lists_.records.begin(), lists_.records.end(), [](const auto& entry) {
    return entry.second->entity->watch().fd >= 0;
  }));
  try {
    for (const auto& [id, record] : lists_.records) places.watch(*record);
  } catch (...) {
    places.forget();
    for (const auto& [id, record] : lists_.records) record->is_watched = false;
    throw;
  }
}

// ---- Observing ----

bool Callbacks::is_used_by(const Node* node) const {
  {
    const std::lock_guard lock(lists_.mutex);
    if (!lists_.records.empty()) return true;
  }
  if (node == nullptr) return false;
  const auto groups = node->groups();
  return node->belongs_to(this) ||
         std::any_of(groups.begin(), groups.end(),
                     [this](const auto& group) { return group->belongs_to(this); });
}

TimePoint Callbacks::next_release() const noexcept {
  const std::lock_guard lock(lists_.mutex);
  return dispatcher_.ready().next_release();
}

}  // namespace takt::detail
