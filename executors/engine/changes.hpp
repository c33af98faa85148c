// What control threads have changed since the last update, and how it becomes the next one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_CHANGES_HPP_
#define TAKT_EXECUTORS_ENGINE_CHANGES_HPP_

#include <cstddef>
#include <memory>
#include <vector>

#include "takt/executors/engine/dispatcher.hpp"
#include "takt/executors/engine/record.hpp"
#include "takt/executors/engine/schedule_update.hpp"

namespace takt::detail {

/// Thread safety: none; the callbacks' mutex is held. Real-time: no.
class Changes {
 public:
  /// `options` name the scheduler.
  Changes(Dispatcher& dispatcher, const ExecutorOptions& options)
      : dispatcher_(dispatcher), options_(options) {}

  bool are_pending() const noexcept { return are_pending_; }

  void added() noexcept { are_pending_ = true; }
  /// Sends the update to the workers, with what was added since the last one. `changed`: these get
  /// the settings that are wanted. Throws what a user's scheduler throws; then nothing has changed.
  void publish(const CallbackRecords& records, const std::vector<ScheduleUpdate::Change>& changed);
  /// Sends an update that removes these records, which were handed over. `records`: the others.
  void publish_removal(const std::vector<CallbackRecord*>& removed, const CallbackRecords& records);

 private:
  std::unique_ptr<ScheduleUpdate> make(const CallbackRecords& records,
                                       const ScheduleUpdate* earlier) const;
  void configure(ScheduleUpdate& update) const;
  void send(std::unique_ptr<ScheduleUpdate> update) noexcept;

  Dispatcher& dispatcher_;
  const ExecutorOptions& options_;
  bool are_pending_ = true;  // the first update brings the scheduler
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_CHANGES_HPP_
