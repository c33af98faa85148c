// Changes by control threads: updates, which a dispatch point installs.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>
#include <unordered_map>
#include <unordered_set>

#include "takt/base/logger.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"
#include "takt/executors/engine/wait_in_callback.hpp"
#include "takt/nodes/callback_info.hpp"

namespace takt {

detail::CallbackSettings DispatchingExecutor::settings(const Record& record,
                                                       const Node& node) const {
  CallbackSettings settings = record.wanted;
  settings.overrun =
      node.callback_parameters(*record.entity).overrun.value_or(OverrunPolicy::catch_up);
  settings.info = callback_info(node, *record.entity, record.wanted.info);
  return settings;
}

void DispatchingExecutor::parameters_changed(Node& node) {
  const auto entities = node.entities();
  const std::lock_guard lock(control_mutex_);
  std::vector<std::pair<Record*, CallbackSettings>> before;
  const std::size_t changes = changes_.changed.size();
  for (const auto& entity : entities) {
    const auto known = of_entity_.find(entity.get());
    if (known == of_entity_.end()) continue;
    Record& record = *known->second;
    CallbackSettings now = settings(record, node);
    if (now == record.wanted) continue;
    before.emplace_back(&record, record.wanted);
    record.wanted = now;
    has_changes_ = true;
    if (record.is_handed_over) {
      changes_.changed.push_back({&record, now});
    } else {
      record.settings = now;
    }
  }
  if (before.empty() || !spinning_.load()) return;
  try {
    publish_update();
  } catch (...) {  // a user's scheduler refuses them: undo all
    for (const auto& [record, settings] : before) record->wanted = settings;
    changes_.changed.erase(changes_.changed.begin() + static_cast<std::ptrdiff_t>(changes),
                           changes_.changed.end());
    throw;
  }
}

// Called with control_mutex_ held. Throws what a user's scheduler throws; then nothing has changed.
void DispatchingExecutor::publish_update() {
  std::unique_ptr<ScheduleUpdate> earlier{update_.exchange(nullptr)};
  std::unique_ptr<ScheduleUpdate> update;
  try {
    update = make_update(earlier.get());
    configure(*update);
  } catch (...) {
    if (earlier != nullptr) send(std::move(earlier));
    throw;
  }
  group_ids_.forget_gone();
  node_ids_.forget_gone();
  hand_over(std::move(update));
}

void DispatchingExecutor::hand_over(std::unique_ptr<ScheduleUpdate> update) noexcept {
  for (CallbackRecord* added : update->added) {
    auto& record = static_cast<Record&>(*added);
    if (!std::exchange(record.is_handed_over, true)) record.state.retain();  // by the ready set
  }
  changes_.removed.clear();
  changes_.changed.clear();
  has_changes_ = false;
  send(std::move(update));
}

// As publish_update; but a scheduler that throws keeps the callbacks that it has: more than it
// needs.
void DispatchingExecutor::publish_removal() noexcept {
  try {
    publish_update();
  } catch (...) {
    log(LogLevel::error,
        "executor '{}': scheduler '{}' threw when callbacks were removed; it goes "
        "on as it is",
        options_.name, scheduler_);
    std::unique_ptr<ScheduleUpdate> earlier{update_.exchange(nullptr)};
    std::unique_ptr<ScheduleUpdate> update = make_update(earlier.get());
    if (earlier != nullptr) {
      update->scheduler = std::move(earlier->scheduler);
      update->parking = std::move(earlier->parking);
    }
    hand_over(std::move(update));
  }
}

// Includes the changes of an earlier update that is not installed yet.
std::unique_ptr<detail::ScheduleUpdate> DispatchingExecutor::make_update(
    const ScheduleUpdate* earlier) const {
  auto update = std::make_unique<ScheduleUpdate>();
  if (earlier != nullptr) {
    update->added = earlier->added;
    update->removed = earlier->removed;
    update->changed = earlier->changed;
  }
  std::copy(changes_.removed.begin(), changes_.removed.end(), std::back_inserter(update->removed));
  std::copy(changes_.changed.begin(), changes_.changed.end(), std::back_inserter(update->changed));
  std::unordered_set<Exclusion*> known;
  const auto park = [&](const CallbackRecord& record) {
    Exclusion* const exclusion = record.exclusion.get();
    if (known.insert(exclusion).second) update->parking.push_back({exclusion, {}});
  };
  // A group that loses its last callback gets an empty parking place instead of the one with its
  // records.
  for (const CallbackRecord* record : update->removed) park(*record);
  for (const auto& [id, record] : records_) {
    park(*record);
    if (!record->is_handed_over) update->added.push_back(record.get());
    update->all.push_back(record.get());
    update->reads_clock |= must_be_checked(*record, record->wanted);
  }
  update->timers.reserve(records_.size());
  update->next_snapshot.resize(records_.size());
  if (trigger_ != nullptr) update->trigger_inputs.resize(records_.size());
  if (let_ != nullptr) {
    update->executions = std::make_shared<std::vector<Execution>>();
    update->executions->reserve(records_.size());
  }
  return update;
}

// Gives the update schedulers that know all callbacks.
void DispatchingExecutor::configure(ScheduleUpdate& update) const {
  std::vector<CallbackInfo> infos;
  std::unordered_map<const Exclusion*, std::vector<CallbackInfo>> members;
  for (const auto& [id, record] : records_) {
    infos.push_back(record->wanted.info);
    members[record->exclusion.get()].push_back(record->wanted.info);
  }
  update.scheduler = schedulers().make(scheduler_);
  update.scheduler->configure(infos);
  for (auto& parking : update.parking) {
    parking.scheduler = schedulers().make(scheduler_);
    parking.scheduler->configure(members[parking.exclusion]);
  }
}

void DispatchingExecutor::send(std::unique_ptr<ScheduleUpdate> update) noexcept {
  update_.store(update.release());
  detail::WaitInCallback::notify_progress();
  wake();
}

// Serialised with dispatch: called by a worker under the lock, or while no thread spins.
void DispatchingExecutor::install_pending_update() noexcept {
  if (ScheduleUpdate* update = update_.exchange(nullptr)) {
    ready_.install(*update);
    if (let_ != nullptr) let_->taken.swap(update->executions);
    used_updates_.push(*update);
    detail::WaitInCallback::notify_progress();
  }
}

// Called with control_mutex_ held. The caller destroys the records after it has released the mutex:
// a user's callback is destroyed with its record, and may hold another entity of this executor.
DispatchingExecutor::Records DispatchingExecutor::take_unused() noexcept {
  for (ScheduleUpdate* update = used_updates_.take_all(); update != nullptr;) {
    const std::unique_ptr<ScheduleUpdate> used(update);
    update = update->inbox_next;
  }
  Records gone;
  for (auto& record : removed_) {
    if (!record->may_be_freed()) continue;
    if (record->entity != nullptr) remember_statistics_of(*record);
    gone.push_back(std::move(record));
  }
  std::erase(removed_, nullptr);
  return gone;
}

}  // namespace takt
