// What control threads do: adding to an executor and removing from it.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>

#include <fmt/format.h>

#include "takt/entities/chain.hpp"
#include "takt/executors/dispatching_executor.hpp"

namespace takt {
namespace {

std::uint32_t id_of(std::vector<std::pair<const void*, std::uint32_t>>& ids, const void* object) {
  const auto known = std::find_if(ids.begin(), ids.end(),
                                  [&](const auto& entry) { return entry.first == object; });
  if (known != ids.end()) return known->second;
  ids.emplace_back(object, static_cast<std::uint32_t>(ids.size()));
  return ids.back().second;
}

}  // namespace

DispatchingExecutor::~DispatchingExecutor() {
  if (options_.watchdog != nullptr) options_.watchdog->remove(watched_callbacks_);
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      node->remove_listener(*this);
    }
  }
  std::vector<Record*> mine;
  {
    const std::lock_guard lock(control_mutex_);
    const std::lock_guard ownership(ownership_mutex());
    for (const auto& record : records_) {
      if (record->entity->owner() != record.get()) continue;  // its remover is on the way
      record->entity->set_owner(nullptr);
      expected_removals_.fetch_add(1);
      mine.push_back(record.get());
    }
  }
  for (Record* record : mine) remove(*record);
  for (std::size_t left; (left = expected_removals_.load()) != 0;) expected_removals_.wait(left);
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) {
      for (const auto& group : node->groups()) group->release(static_cast<NodeListener*>(this));
      node->release(this);
    }
  }
  delete plan_.load();
  take_what_is_gone();
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
  if (!node->claim(this)) {
    throw Error("node '" + node->fully_qualified_name() + "' belongs to an executor already",
                "remove it there first");
  }
  remember(node);
  node->add_listener(*this);
  try {
    for (const auto& group : node->groups()) {
      if (group->automatically_add_to_executor() &&
          group->claim(static_cast<NodeListener*>(this))) {
        add_group(group, *node);
      }
    }
  } catch (...) {
    remove_node(node);
    throw;
  }
}

void DispatchingExecutor::add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                             const std::shared_ptr<Node>& node) {
  refuse_when_frozen("added");
  const auto groups = node->groups();
  if (std::find(groups.begin(), groups.end(), group) == groups.end()) {
    throw Error(fmt::format("callback group '{}' is not one of node '{}'", group->name(),
                            node->fully_qualified_name()));
  }
  if (!group->claim(static_cast<NodeListener*>(this))) {
    throw Error(fmt::format("callback group '{}' of node '{}' belongs to an executor already",
                            group->name(), node->fully_qualified_name()),
                "remove it there first");
  }
  remember(node);
  node->add_listener(*this);
  try {
    add_group(group, *node);
  } catch (...) {
    release_group(*group, *node);
    throw;
  }
}

void DispatchingExecutor::remember(const std::shared_ptr<Node>& node) {
  const std::lock_guard lock(control_mutex_);
  std::erase_if(nodes_, [](const auto& known) { return known.expired(); });
  nodes_.push_back(node);
}

void DispatchingExecutor::add_group(const std::shared_ptr<CallbackGroup>& group, Node& node) {
  for (const auto& entity : node.entities()) {
    if (entity->group() == group) add_entity(entity, node);
  }
}

void DispatchingExecutor::group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) {
  if (node.belongs_to(this) && group->automatically_add_to_executor()) {
    group->claim(static_cast<NodeListener*>(this));
  }
}

void DispatchingExecutor::entity_added(Node& node, const std::shared_ptr<Entity>& entity) {
  if (!entity->group()->belongs_to(static_cast<NodeListener*>(this))) return;
  refuse_when_frozen("added");
  add_entity(entity, node);
}

void DispatchingExecutor::add_entity(const std::shared_ptr<Entity>& entity, const Node& node) {
  std::vector<std::unique_ptr<Record>> gone;
  const std::lock_guard lock(control_mutex_);
  gone = take_what_is_gone();
  auto record = std::make_unique<Record>(*this);
  record->entity = entity;
  record->group = entity->group();
  record->node = node.fully_qualified_name();
  const CallbackParameters parameters = node.callback_parameters(*entity);
  record->of_node = &node;
  record->supervision = std::make_shared<Supervision>();
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
                         .group = id_of(group_ids_, record->group.get()),
                         .node = id_of(node_ids_, &node)};
  record->settings = record->wanted = settings(*record, node);
  ++next_callback_id_;
  {
    const std::lock_guard ownership(ownership_mutex());
    if (entity->owner() != nullptr) return;  // seen twice: in the node's list, and as news
    entity->set_owner(record.get());
  }
  try {
    watch(*entity);
  } catch (...) {
    const std::lock_guard ownership(ownership_mutex());
    entity->set_owner(nullptr);
    throw;
  }
  changes_.added.push_back(record.get());
  records_.push_back(std::move(record));
  has_changes_ = true;
  if (!spinning_.load()) return;
  try {
    hand_plan_over();
  } catch (...) {  // a user's scheduler does not take it: all is as before
    changes_.added.pop_back();
    unwatch(*entity);
    {
      const std::lock_guard ownership(ownership_mutex());
      entity->set_owner(nullptr);
    }
    records_.pop_back();
    throw;
  }
}

// What the parameters of the callback, and its most critical chain, come to.
CallbackSettings DispatchingExecutor::settings(const Record& record, const Node& node) const {
  const CallbackParameters parameters = node.callback_parameters(*record.entity);
  CallbackSettings settings = record.wanted;
  settings.overrun = parameters.overrun.value_or(OverrunPolicy::catch_up);
  CallbackInfo& info = settings.info;
  info.priority = parameters.priority.value_or(0);
  info.deadline = parameters.deadline.value_or(Nanoseconds::zero());
  info.budget = parameters.budget.value_or(Nanoseconds::zero());
  info.period = record.entity->period();
  if (info.period == Nanoseconds::zero()) {
    info.period = parameters.period.value_or(Nanoseconds::zero());
  }
  const auto& steps = record.entity->chain_steps();
  const auto step = std::max_element(steps.begin(), steps.end(), [](const auto& a, const auto& b) {
    return a.chain->options().priority < b.chain->options().priority;
  });
  if (step != steps.end()) {
    info.chain = step->chain->id();
    info.chain_position = step->position;
    info.criticality = step->chain->options().priority;
  }
  info.criticality = parameters.criticality.value_or(info.criticality);
  return settings;
}

void DispatchingExecutor::parameters_changed(Node& node) {
  const std::lock_guard lock(control_mutex_);
  for (const auto& record : records_) {
    if (record->of_node != &node) continue;
    CallbackSettings now = settings(*record, node);
    if (now == record->wanted) continue;
    record->wanted = now;
    changes_.changed.push_back({record.get(), now});
    has_changes_ = true;
  }
  if (has_changes_ && spinning_.load()) hand_plan_over();
}

void DispatchingExecutor::remove_node(const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!node->belongs_to(this)) {
    throw Error("node '" + node->fully_qualified_name() + "' does not belong to executor '" +
                options_.name + "'");
  }
  node->remove_listener(*this);
  for (const auto& group : node->groups()) {
    if (group->belongs_to(static_cast<NodeListener*>(this))) release_group(*group, *node);
  }
  node->release(this);
}

void DispatchingExecutor::remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                                                const std::shared_ptr<Node>& node) {
  refuse_when_frozen("removed");
  if (!group->belongs_to(static_cast<NodeListener*>(this))) {
    throw Error(fmt::format("callback group '{}' of node '{}' does not belong to executor '{}'",
                            group->name(), node->fully_qualified_name(), options_.name));
  }
  release_group(*group, *node);
}

void DispatchingExecutor::release_group(CallbackGroup& group, const Node& node) noexcept {
  for (const auto& entity : node.entities()) {
    if (entity->group().get() == &group) entity->Entity::retire();
  }
  group.release(static_cast<NodeListener*>(this));
}

// 1. The record leaves the list, so that the next plan does not know it. Its file descriptor, if it
//    has one, is not watched any more.
// 2. A dispatch point installs that plan: from then on the record is skipped wherever it stands.
// 3. The running callback ends; then nobody executes the entity any more.
// 4. The entity forgets its sink; when all read sections have ended, nobody announces any more.
// 5. The record is freed when it has come out of inbox and scheduler.
void DispatchingExecutor::remove(Record& record) noexcept {
  {
    const std::lock_guard lock(control_mutex_);
    const auto entry = std::find_if(records_.begin(), records_.end(),
                                    [&](const auto& known) { return known.get() == &record; });
    removed_records_.push_back(std::move(*entry));
    records_.erase(entry);
    unwatch(*record.entity);
    changes_.removed.push_back(&record);
    hand_plan_over();
    if (!spinning_.load()) install_plan();
  }
  if (worker_of_ == this) {
    lock();
    install_plan();
    unlock();
  }
  const Dispatch* dispatch = Dispatch::current();
  if (dispatch == nullptr || !record.is_described_by(dispatch->callback)) record.gone.wait(0);
  record.entity->detach();
  std::vector<std::unique_ptr<Record>> gone;
  {
    const std::lock_guard lock(control_mutex_);
    record.detached = true;
    gone = take_what_is_gone();
  }
  gone.clear();
  if (expected_removals_.fetch_sub(1) == 1) expected_removals_.notify_all();
}

// ---- File descriptors: with control_mutex_ held ----

void DispatchingExecutor::choose_wait_backend() {
  const bool has_file_descriptors =
      std::any_of(records_.begin(), records_.end(),
                  [](const auto& record) { return record->entity->watch().fd >= 0; });
  backend_ =
      make_wait_backend(options_.wait, *options_.clock, threads_.size(), has_file_descriptors);
  try {
    for (const auto& record : records_) watch(*record->entity);
  } catch (...) {
    backend_.reset();
    watched_.store(0);
    throw;
  }
}

// Before the first spin may have chosen the back end nothing can be watched; then it is done there.
void DispatchingExecutor::watch(Entity& entity) {
  const Watch watch = entity.watch();
  if (watch.fd < 0 || backend_ == nullptr) return;
  if (!backend_->serves_file_descriptors()) {
    const bool is_auto = options_.wait == kAutoWait;
    throw Error(fmt::format("executor '{}' waits by '{}', which cannot serve file descriptor '{}'",
                            options_.name, is_auto ? "futex" : options_.wait, entity.name()),
                is_auto ? "add the first one before the first spin, or choose `wait: epoll`"
                        : "choose `wait: epoll`, or leave it out");
  }
  backend_->watch(watch);
  watched_.fetch_add(1);
}

void DispatchingExecutor::unwatch(Entity& entity) noexcept {
  const Watch watch = entity.watch();
  if (watch.fd < 0 || backend_ == nullptr) return;
  backend_->unwatch(watch.listener);
  watched_.fetch_sub(1);
}

// ---- Plans ----

// With control_mutex_ held. What an earlier plan, not yet installed, would have changed is taken
// along.
void DispatchingExecutor::hand_plan_over() {
  auto plan = std::make_unique<ReadyPlan>();
  if (const std::unique_ptr<ReadyPlan> earlier{plan_.exchange(nullptr)}) {
    const auto before = [](auto& ours, const auto& earlier_ones) {
      ours.insert(ours.begin(), earlier_ones.begin(), earlier_ones.end());
    };
    before(changes_.added, earlier->added);
    before(changes_.removed, earlier->removed);
    before(changes_.changed, earlier->changed);
  }
  std::vector<CallbackInfo> infos;
  std::vector<std::pair<CallbackGroup*, std::vector<CallbackInfo>>> groups;
  const auto members_of = [&groups](const CallbackRecord& record) -> std::vector<CallbackInfo>& {
    CallbackGroup* group = record.group.get();
    for (auto& known : groups) {
      if (known.first == group) return known.second;
    }
    return groups.emplace_back(group, std::vector<CallbackInfo>{}).second;
  };
  // A group whose last callback goes gets an empty parking place instead of the one with its
  // records.
  for (const CallbackRecord* record : changes_.removed) members_of(*record);
  for (const auto& record : records_) {
    const CallbackInfo& info = record->wanted.info;
    infos.push_back(info);
    members_of(*record).push_back(info);
    plan->all.push_back(record.get());
    plan->reads_clock |= must_be_judged(*record, record->wanted);
  }
  plan->scheduler = schedulers().make(scheduler_);
  plan->scheduler->configure(infos);
  for (const auto& [group, members] : groups) {
    plan->parking.push_back({group, schedulers().make(scheduler_)});
    plan->parking.back().scheduler->configure(members);
  }
  plan->timers.reserve(infos.size());
  if (trigger_ != nullptr) plan->trigger_inputs.resize(infos.size());
  if (let_ != nullptr) {
    const auto room = std::make_shared<std::vector<Execution>>();
    room->reserve(infos.size());
    plan->room = room;
  }
  // From here on nothing can fail.
  plan->added = std::exchange(changes_.added, {});
  plan->removed = std::exchange(changes_.removed, {});
  plan->changed = std::exchange(changes_.changed, {});
  has_changes_ = false;
  plan_.store(plan.release());
  wake();
}

// Serialised with dispatch: by a worker under the lock, or while nobody spins.
void DispatchingExecutor::take_plan_over() noexcept {
  if (ReadyPlan* plan = plan_.exchange(nullptr)) {
    ready_.install(*plan);
    if (let_ != nullptr) let_->taken.swap(plan->room);
    used_plans_.push(*plan);
  }
}

// With control_mutex_ held; the caller destroys them after it is released, because what a user's
// callback holds goes with them, and may be another entity of ours.
std::vector<std::unique_ptr<DispatchingExecutor::Record>>
DispatchingExecutor::take_what_is_gone() noexcept {
  for (ReadyPlan* plan = used_plans_.take_all(); plan != nullptr;) {
    const std::unique_ptr<ReadyPlan> used(plan);
    plan = plan->inbox_next;
  }
  std::vector<std::unique_ptr<Record>> gone;
  for (auto& record : removed_records_) {
    if (record->gone.load() == 1 && record->detached && !record->queued.load() &&
        !record->held.load() && !record->changed.load()) {
      if (options_.statistics != StatisticsLevel::off) past_.add(statistics_of(*record));
      gone.push_back(std::move(record));
    }
  }
  std::erase(removed_records_, nullptr);
  return gone;
}

}  // namespace takt
