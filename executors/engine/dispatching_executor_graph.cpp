// What control threads do: adding to an executor and removing from it.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>

#include <fmt/format.h>

#include "takt/executors/engine/dispatching_executor.hpp"
#include "takt/executors/engine/wait_in_callback.hpp"

namespace takt {
DispatchingExecutor::~DispatchingExecutor() {
  if (options_.watchdog != nullptr) options_.watchdog->remove(watched_callbacks_);
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      node->remove_listener(listener_);
    }
  }
  std::vector<Record*> mine;
  {
    const std::lock_guard lock(control_mutex_);
    is_ending_ = true;
    for (const auto& [id, record] : records_) {
      if (claim_removal(*record)) mine.push_back(record.get());
    }
  }
  remove(mine);
  wait_for_removals();
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      for (const auto& group : node->groups()) group->release(&listener_);
      node->release(&listener_);
    }
  }
  delete update_.load();
  take_unused();
}

// Waits until no thread removes a callback or waits for a removal. From then on none begins to
// wait: a thread that drops a handle later finds no record.
void DispatchingExecutor::wait_for_removals() noexcept {
  for (;;) {
    for (std::size_t left; (left = expected_removals_.load()) != 0;) expected_removals_.wait(left);
    const std::lock_guard lock(control_mutex_);
    const std::lock_guard ownership(ownership_mutex());
    if (expected_removals_.load() != 0) continue;
    for (const auto& record : removed_) record->forget_earlier_owner();
    return;
  }
}

// ---- Adding and removing: control threads ----

void DispatchingExecutor::refuse_when_frozen(const char* what) const {
  const std::lock_guard lock(control_mutex_);
  if (traits_.frozen && was_spun_) {
    throw Error(fmt::format("executor '{}' is static: nothing can be {} after its first spin",
                            options_.name, what),
                "do it before, or choose 'single_threaded'");
  }
}

void DispatchingExecutor::add_node(const std::shared_ptr<Node>& node) {
  refuse_when_frozen("added");
  if (!node->claim(&listener_)) {
    throw Error("node '" + node->fully_qualified_name() + "' belongs to an executor already",
                "remove it there first");
  }
  remember(node);
  node->add_listener(listener_);
  try {
    for (const auto& group : node->groups()) {
      if (group->automatically_add_to_executor() && group->claim(&listener_)) {
        add_group(group, *node);
      }
    }
  } catch (...) {
    remove_node(node);
    throw;
  }
  if (!node->belongs_to(&listener_)) release_groups(node->groups(), *node);  // removed meanwhile
}

void DispatchingExecutor::add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                             const std::shared_ptr<Node>& node) {
  refuse_when_frozen("added");
  const auto groups = node->groups();
  if (std::find(groups.begin(), groups.end(), group) == groups.end()) {
    throw Error(fmt::format("callback group '{}' is not one of node '{}'", group->name(),
                            node->fully_qualified_name()));
  }
  if (!group->claim(&listener_)) {
    throw Error(fmt::format("callback group '{}' of node '{}' belongs to an executor already",
                            group->name(), node->fully_qualified_name()),
                "remove it there first");
  }
  remember(node);
  node->add_listener(listener_);
  try {
    add_group(group, *node);
  } catch (...) {
    release_groups({group}, *node);
    throw;
  }
}

void DispatchingExecutor::remember(const std::shared_ptr<Node>& node) {
  const std::lock_guard lock(control_mutex_);
  if (!nodes_.empty() && !nodes_.back().owner_before(node) && !node.owner_before(nodes_.back())) {
    return;  // another group of the same node
  }
  if (nodes_.size() == nodes_.capacity()) {  // rarely, so that n nodes cost O(n)
    std::erase_if(nodes_, [](const auto& known) { return known.expired(); });
  }
  nodes_.push_back(node);
}

void DispatchingExecutor::add_group(const std::shared_ptr<CallbackGroup>& group, Node& node) {
  for (const auto& entity : node.entities()) {
    if (entity->group() == group) add_entity(entity, node);
  }
}

void DispatchingExecutor::group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) {
  if (node.belongs_to(&listener_) && group->automatically_add_to_executor()) {
    group->claim(&listener_);
  }
}

void DispatchingExecutor::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  if (!entity->group()->belongs_to(&listener_)) return;
  refuse_when_frozen("added");
  add_entity(entity, node);
}

// Now, as nothing is allocated when they are filled.
static void make_histograms(detail::CallbackRecord& record) {
  record.times = std::make_unique<CallbackTimes>();
  if (!has_message_times(record.entity->kind())) return;
  record.message_times = std::make_unique<MessageTimes>();
}

void DispatchingExecutor::add_entity(const std::shared_ptr<Entity>& entity, const Node& node) {
  // They go after the lock, as they hold functions of the user.
  Records gone;
  auto record = std::make_unique<Record>(*this);
  const CallbackParameters parameters = node.callback_parameters(*entity);
  const std::lock_guard lock(control_mutex_);
  if (removals_.contains(entity->group().get())) return;  // as if created after the removal
  gone = take_unused();
  record->entity = entity;
  record->takes_briefly = entity->takes_briefly();
  record->group = entity->group();
  record->node = node.fully_qualified_name();
  if (records_times_) make_histograms(*record);
  auto& known_node = node_ids_.of(&node);
  known_node.alive = node.weak_from_this();
  auto& group = group_ids_.of(record->group.get());
  record->exclusion = group.alive.lock();
  if (record->exclusion == nullptr) {
    record->exclusion = std::make_shared<Exclusion>(record->group->type());
    group.alive = record->exclusion;
  }
  record->supervision = std::make_shared<detail::Supervision>(threads_.size());
  record->supervision->node = record->node;
  record->supervision->callback = entity->name();
  record->supervision->on_deadline_miss = parameters.on_deadline_miss;
  record->supervision->on_overrun = parameters.on_overrun;
  const auto& order = options_.order;
  const auto listed = std::find_if(order.begin(), order.end(), [&](const std::string& name) {
    return is_called(*record, name);
  });
  const auto place = static_cast<std::uint32_t>(listed - order.begin());
  record->wanted.info = {.id = next_callback_id_,
                         .kind = entity->kind(),
                         .registration = place + (listed == order.end() ? next_callback_id_ : 0),
                         .group = group.number,
                         .node = known_node.number};
  record->settings = record->wanted = settings(*record, node);
  ++next_callback_id_;
  {
    const std::lock_guard ownership(ownership_mutex());
    // It was found twice, in the node's list and as an added entity; or it was dropped, and is not
    // destroyed yet.
    if (!entity->is_free() || entity->is_retired()) return;
    entity->set_owner(record.get());
  }
  Record& added = *record;
  of_entity_.emplace(entity.get(), &added);
  records_.emplace(added.key(), std::move(record));
  try {
    watch(added);
    has_changes_ = true;
    if (spinning_.load()) publish_update();
  } catch (...) {  // a user's scheduler refuses it: undo all
    undo_add(added);
    throw;
  }
}

// Called with control_mutex_ held. If another thread has dropped the entity meanwhile, it waits for
// that mutex and completes the removal.
void DispatchingExecutor::undo_add(Record& record) noexcept {
  take_from_lists(record);
  {
    const std::lock_guard ownership(ownership_mutex());
    if (record.entity->owner() != &record) return;
    record.entity->set_owner(nullptr);
  }
  removed_.pop_back();
}

void DispatchingExecutor::remove_node(const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!node->belongs_to(&listener_)) {
    throw Error("node '" + node->fully_qualified_name() + "' does not belong to executor '" +
                options_.name + "'");
  }
  node->remove_listener(listener_);
  release_groups(node->groups(), *node, /*with_node=*/true);
}

void DispatchingExecutor::remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                                const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!group->belongs_to(&listener_)) {
    throw Error(fmt::format("callback group '{}' of node '{}' does not belong to executor '{}'",
                            group->name(), node->fully_qualified_name(), options_.name));
  }
  release_groups({group}, *node);
}

// Called with control_mutex_ held. Returns the number of the removal in progress, or begins one.
std::uint64_t DispatchingExecutor::begin_removal(const void* what) {
  const auto [removal, is_new] = removals_.try_emplace(what, last_removal_ + 1);
  if (is_new) ++last_removal_;
  return removal->second;
}

// Called with control_mutex_ held. Returns false if another thread has ended this removal: what the
// executor has now was added later.
bool DispatchingExecutor::ends_removal(const void* what, std::uint64_t removal) noexcept {
  const auto known = removals_.find(what);
  if (known == removals_.end() || known->second != removal) return false;
  removals_.erase(known);
  return true;
}

// Removes all callbacks of those groups that belong to this executor, with one update. Waits for
// callbacks that another thread is already removing.
void DispatchingExecutor::release_groups(std::vector<std::shared_ptr<CallbackGroup>> groups,
                                         Node& node, bool with_node) noexcept {
  const auto is_meant = [&](const Record& record) {
    return std::find(groups.begin(), groups.end(), record.group) != groups.end();
  };
  std::vector<std::shared_ptr<Entity>> entities;
  std::vector<Record*> mine;
  std::vector<Record*> of_others;
  std::vector<std::uint64_t> removals;
  {
    const std::lock_guard lock(control_mutex_);
    std::erase_if(groups, [this](const auto& group) { return !group->belongs_to(&listener_); });
    for (const auto& group : groups) removals.push_back(begin_removal(group.get()));
    if (with_node) removals.push_back(begin_removal(&node));
    entities = node.entities();  // from here on nothing is added to the groups
    for (const auto& entity : entities) {
      const auto known = of_entity_.find(entity.get());
      if (known == of_entity_.end() || !is_meant(*known->second)) continue;
      if (claim_removal(*known->second)) {
        mine.push_back(known->second);
      } else {
        of_others.push_back(known->second);
      }
    }
    for (const auto& record : removed_) {
      if (is_meant(*record)) of_others.push_back(record.get());
    }
    for (Record* record : of_others) record->state.retain();
  }
  remove(mine);
  for (Record* record : of_others) wait_for_removal(*record);
  const std::lock_guard lock(control_mutex_);
  for (Record* record : of_others) record->state.release();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (ends_removal(groups[i].get(), removals[i])) groups[i]->release(&listener_);
  }
  if (with_node && ends_removal(&node, removals.back())) node.release(&listener_);
}

bool DispatchingExecutor::is_used_by(const Node* node) const {
  {
    const std::lock_guard lock(control_mutex_);
    if (!records_.empty()) return true;
  }
  if (node == nullptr) return false;
  const auto groups = node->groups();
  return node->belongs_to(&listener_) ||
         std::any_of(groups.begin(), groups.end(),
                     [this](const auto& group) { return group->belongs_to(&listener_); });
}

// Called with control_mutex_ held. Returns true if the caller, and no other thread, removes the
// record.
bool DispatchingExecutor::claim_removal(Record& record) noexcept {
  const std::lock_guard ownership(ownership_mutex());
  if (record.entity->owner() != &record) return false;  // another thread removes it
  record.entity->set_owner(nullptr);
  record.expect_remove();
  return true;
}

// A callback that removes itself does not wait: the removal is complete when it returns. Of
// callbacks that remove each other, one must not wait. A thread that waits inside a callback may be
// the only one that can install an update for which another thread waits: one of its own executor,
// or of the executor of an outer callback.
void DispatchingExecutor::wait_until_over(const Record& record) noexcept {
  if (worker_of_ == nullptr) return record.state.wait_until_over();
  const detail::WaitInCallback wait(record);
  for (;;) {
    const std::uint32_t seen = detail::WaitInCallback::progress();
    install_updates_here();
    if (record.state.is_over() || (wait.is_for_itself() && record.state.is_removed())) return;
    detail::WaitInCallback::wait_for_progress(seen);
  }
}

// A thread that is preempted here delays others only for that time.
void DispatchingExecutor::detach(Record& record) noexcept {
  if (!record.state.begin_to_detach()) return record.state.wait_until_detached();
  record.entity->detach();
  record.state.set_detached();
}

void DispatchingExecutor::wait_for_removal(Record& record) noexcept {
  wait_until_over(record);
  detach(record);
}

void DispatchingExecutor::removal_is_over(std::size_t count) noexcept {
  if (expected_removals_.fetch_sub(count) == count) expected_removals_.notify_all();
}

// 1. The records leave the list, so that the next update does not contain them. Their file
//    descriptors are no longer watched.
// 2. A dispatch point installs that update: from then on they are skipped wherever they are.
// 3. The running callbacks end; then no thread executes the entities.
// 4. The entities drop their sinks; when all read sections have ended, no thread announces them.
// 5. A record without references is freed: none of these threads uses it, and neither does the
// ready
//    set.
void DispatchingExecutor::remove(const std::vector<Record*>& records) noexcept {
  if (records.empty()) return;
  bool at_rest = false;
  {
    const std::lock_guard lock(control_mutex_);
    at_rest = !spinning_.load();
    for (Record* record : records) take_from_lists(*record);
    if (at_rest) {
      remove_at_rest(records);
    } else {
      publish_removal();
    }
  }
  for (const Record* record : records) wait_until_over(*record);
  for (Record* record : records) detach(*record);
  // Destroy what the user's callbacks hold without the lock: it may be another entity of this
  // executor.
  std::vector<std::shared_ptr<Entity>> released;
  Records gone;
  {
    const std::lock_guard lock(control_mutex_);
    for (Record* record : records) {
      if (at_rest) {
        remember_statistics_of(*record);
        released.push_back(record->release_entity());
      }
      record->state.release();
    }
    if (!at_rest || changes_.removed.empty()) gone = take_unused();
  }
  released.clear();
  gone.clear();
  removal_is_over(records.size());
}

// With control_mutex_ held.
void DispatchingExecutor::remember_statistics_of(const Record& record) {
  if (is_ending_ || options_.statistics == StatisticsLevel::off || !record.is_handed_over) return;
  past_.add(statistics_of(record));
}

// No execution of it is left, and none begins.
void DispatchingExecutor::mark_removed(Record& record) noexcept {
  record.state.remove(record.is_announced);
  record.notify_over();
}

// With control_mutex_ held.
void DispatchingExecutor::take_from_lists(Record& record) noexcept {
  const auto entry = records_.find(record.key());
  if (entry == records_.end()) return;  // see undo_add
  unwatch(record);
  of_entity_.erase(record.entity.get());
  removed_.push_back(std::move(entry->second));
  records_.erase(entry);
  record.state.release();
  if (record.is_handed_over) {
    changes_.removed.push_back(&record);
    has_changes_ = true;
  } else {
    mark_removed(record);
  }
}

// Called with control_mutex_ held while no thread spins, so none executes. The ready set drops the
// records at the next spin, or when there are many of them: so removing n callbacks costs O(n log
// n).
void DispatchingExecutor::remove_at_rest(const std::vector<Record*>& records) noexcept {
  for (Record* record : records) mark_removed(*record);
  if (changes_.removed.size() <= records_.size()) return;
  try {
    publish_update();
    install_update();
  } catch (...) {  // a user's scheduler threw: the next spin reports it
  }
}

// ---- File descriptors: with control_mutex_ held ----

void DispatchingExecutor::choose_wait_backend() {
  const bool has_file_descriptors =
      std::any_of(records_.begin(), records_.end(),
                  [](const auto& entry) { return entry.second->entity->watch().fd >= 0; });
  backend_ =
      make_wait_backend(options_.wait, *options_.clock, threads_.size(), has_file_descriptors);
  try {
    for (const auto& [id, record] : records_) watch(*record);
  } catch (...) {
    backend_.reset();
    watched_.store(0);
    for (const auto& [id, record] : records_) record->is_watched = false;
    throw;
  }
}

// While the first spin has still to choose the back end, nothing can be watched:
// choose_wait_backend does it.
void DispatchingExecutor::watch(Record& record) {
  const Watch watch = record.entity->watch();
  if (watch.fd < 0 || backend_ == nullptr) return;
  if (!backend_->serves_file_descriptors()) {
    const bool is_auto = options_.wait == kAutoWait;
    throw Error(
        fmt::format("executor '{}' waits by '{}', which cannot serve file descriptor '{}'",
                    options_.name, is_auto ? "futex" : options_.wait, record.entity->name()),
        is_auto ? "add the first one before the first spin, or choose `wait: epoll`"
                : "choose `wait: epoll`, or leave it out");
  }
  backend_->watch(watch);
  record.is_watched = true;
  watched_.fetch_add(1);
}

void DispatchingExecutor::unwatch(Record& record) noexcept {
  if (!std::exchange(record.is_watched, false)) return;
  backend_->unwatch(record.entity->watch().listener);
  watched_.fetch_sub(1);
}

}  // namespace takt
