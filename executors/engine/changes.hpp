// What control threads have changed since the last update, and how it becomes the next one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_CHANGES_HPP_
#define TAKT_EXECUTORS_ENGINE_CHANGES_HPP_

#include <cstddef>
#include <memory>
#include <string>

#include "takt/executors/engine/dispatcher.hpp"
#include "takt/executors/engine/record.hpp"
#include "takt/executors/engine/schedule_update.hpp"

namespace takt::detail {

/// Thread safety: none; the callbacks' mutex is held. Real-time: no.
class Changes {
 public:
  /// `options`: which scheduler.
  Changes(Dispatcher& dispatcher, const ExecutorOptions& options)
      : dispatcher_(dispatcher), options_(options) {}

  bool are_pending() const noexcept { return are_pending_; }

  void added() noexcept { are_pending_ = true; }
  void removed(CallbackRecord& record);
  std::size_t count_removed() const noexcept { return changes_.removed.size(); }
  void changed(CallbackRecord& record, const CallbackSettings& settings);
  std::size_t count_changed() const noexcept { return changes_.changed.size(); }
  /// Undoes all later ones.
  void keep_changed(std::size_t count) { changes_.changed.resize(count); }

  /// Sends the update to the workers. Throws what a user's scheduler throws; then nothing has
  /// changed.
  void publish(const CallbackRecords& records);
  /// As publish, with the scheduler that they have: it knows more callbacks than it needs.
  void publish_without_scheduler(const CallbackRecords& records);

 private:
  std::unique_ptr<ScheduleUpdate> make(const CallbackRecords& records,
                                       const ScheduleUpdate* earlier) const;
  void configure(ScheduleUpdate& update) const;
  void hand_over(std::unique_ptr<ScheduleUpdate> update) noexcept;
  void send(std::unique_ptr<ScheduleUpdate> update) noexcept;

  Dispatcher& dispatcher_;
  const ExecutorOptions& options_;
  ScheduleUpdate changes_;   // only `removed` and `changed`
  bool are_pending_ = true;  // the first update brings the scheduler
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_CHANGES_HPP_
