// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/changes.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace takt::detail {

void Changes::publish(const CallbackRecords& records,
                      const std::vector<ScheduleUpdate::Change>& changed) {
  std::unique_ptr<ScheduleUpdate> earlier = dispatcher_.updates().take_back();
  std::unique_ptr<ScheduleUpdate> update;
  try {
    update = make(records, earlier.get());
    for (const auto& [record, before] : changed) {
      if (record->is_handed_over) update->changed.push_back({record, record->wanted});
    }
    configure(*update);
  } catch (...) {
    if (earlier != nullptr) send(std::move(earlier));
    throw;
  }
  for (CallbackRecord* record : update->added) {
    if (!std::exchange(record->is_handed_over, true)) record->state.retain();  // by the ready set
  }
  are_pending_ = false;
  send(std::move(update));
}

void Changes::publish_removal(const std::vector<CallbackRecord*>& removed,
                              const CallbackRecords& records) {
  std::unique_ptr<ScheduleUpdate> update = dispatcher_.updates().take_back();
  if (update == nullptr) update = std::make_unique<ScheduleUpdate>();
  for (CallbackRecord* record : removed) {
    update->removed.push_back(record);
    Exclusion* const exclusion = record->exclusion.get();
    if (std::none_of(update->parking.begin(), update->parking.end(),
                     [&](const auto& parking) { return parking.exclusion == exclusion; })) {
      update->parking.push_back({exclusion, {}});
    }
    std::erase(update->all, record);
  }
  // A group that loses its most urgent callback has a lower ceiling: more callbacks of other groups
  // may interrupt it.
  if (update->levels.empty() && dispatcher_.ready().selection().interrupts()) {
    for (const auto& [id, record] : records)
      update->levels.emplace_back(record.get(), record->level.load());
  }
  send(std::move(update));
}

void Changes::send(std::unique_ptr<ScheduleUpdate> update) noexcept {
  dispatcher_.updates().send(std::move(update));
  dispatcher_.workers().wake();
}

// Includes the changes of an earlier update that is not installed yet.
std::unique_ptr<ScheduleUpdate> Changes::make(const CallbackRecords& records,
                                              const ScheduleUpdate* earlier) const {
  auto update = std::make_unique<ScheduleUpdate>();
  update->only_removes = false;
  if (earlier != nullptr) {
    update->added = earlier->added;
    update->removed = earlier->removed;
    update->changed = earlier->changed;
  }
  std::unordered_set<Exclusion*> known;
  const auto park = [&](const CallbackRecord& record) {
    Exclusion* const exclusion = record.exclusion.get();
    if (known.insert(exclusion).second) update->parking.push_back({exclusion, {}});
  };
  // A group that loses its last callback gets an empty parking place instead of the one with its
  // records.
  for (const CallbackRecord* record : update->removed) park(*record);
  for (const auto& [id, record] : records) {
    park(*record);
    if (!record->is_handed_over) update->added.push_back(record.get());
    update->all.push_back(record.get());
    update->reads_clock |= record->must_be_checked(record->wanted);
  }
  update->timers.reserve(records.size());
  update->next_snapshot.resize(records.size());
  if (const Rule* rule = dispatcher_.rule()) {
    update->rule_inputs.resize(records.size());
    if (rule->logical_outputs()) {
      update->executions = std::make_shared<std::vector<Execution>>();
      update->executions->reserve(records.size());
    }
  }
  return update;
}

// Gives the update schedulers that know all callbacks.
void Changes::configure(ScheduleUpdate& update) const {
  std::vector<CallbackInfo> infos;
  std::unordered_map<const Exclusion*, std::vector<CallbackInfo>> members;
  for (const CallbackRecord* record : update.all) {
    infos.push_back(record->wanted.seen());
    members[record->exclusion.get()].push_back(infos.back());
  }
  update.scheduler = schedulers().make(options_.scheduler, options_.scheduler_own);
  update.scheduler->configure(infos);
  const std::vector<std::uint32_t> levels = dispatcher_.ready().selection().levels(infos);
  for (std::size_t i = 0; i < levels.size(); ++i)
    update.levels.emplace_back(update.all[i], levels[i]);
  for (auto& parking : update.parking) {
    parking.scheduler = schedulers().make(options_.scheduler, options_.scheduler_own);
    parking.scheduler->configure(members[parking.exclusion]);
  }
}

}  // namespace takt::detail
