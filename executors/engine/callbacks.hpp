// The callbacks of an executor: how they are added, changed and removed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_CALLBACKS_HPP_
#define TAKT_EXECUTORS_ENGINE_CALLBACKS_HPP_

#include <cstddef>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/thread_safety.hpp"
#include "takt/executors/engine/changes.hpp"
#include "takt/executors/engine/dispatcher.hpp"
#include "takt/executors/engine/numbers.hpp"
#include "takt/executors/engine/record.hpp"
#include "takt/executors/engine/removals.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"

namespace takt::detail {

/// The side of control threads. They build a change as an update; a worker installs it at its next
/// dispatch. While no thread spins, the control thread installs it itself.
/// Thread safety: every method from any thread. Real-time: no.
class Callbacks final : private NodeListener, private Watchdog::Watched {
 public:
  Callbacks(const ExecutorOptions& options, Dispatcher& dispatcher);
  /// Removes them all.
  ~Callbacks();
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;

  // As Executor.
  void add_node(const std::shared_ptr<Node>& node);
  void remove_node(const std::shared_ptr<Node>& node);
  void add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                          const std::shared_ptr<Node>& node);
  void remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                             const std::shared_ptr<Node>& node);
  std::size_t pending() const noexcept;
  std::vector<CallbackStatistics> statistics() const;
  std::vector<ThreadStatistics> thread_statistics() const;
  void begin_trace(std::size_t events);
  void end_trace() noexcept;
  /// `threads`: the kernel's numbers, by worker; 0: it does not run.
  std::vector<ThreadStatistics> traces(const std::vector<std::atomic<int>>& threads) const;

  // As DispatchingExecutor.
  void release_groups(std::vector<std::shared_ptr<CallbackGroup>> groups, Node& node,
                      bool with_node = false) noexcept;
  void forget(Node& node) noexcept;
  bool is_used_by(const Node* node) const;
  TimePoint next_release() const noexcept;

  /// The worker's thread begins to spin. Throws Error if another one does. `freezes`: nothing is
  /// added or removed afterwards.
  void begin_spin(Worker& worker, bool freezes);
  void end_spin(Worker& worker) noexcept;

  // For records.
  void remove(const std::vector<CallbackRecord*>& records) noexcept;
  /// Of one, whose entity is dropped or leaves: waits no longer than Entity::drop_wait.
  void remove_dropped(CallbackRecord& record) noexcept;
  Removals& removals() noexcept { return removals_; }

 private:
  using Record = CallbackRecord;

  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override;
  void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) override;
  void parameters_changed(Node& node) override;
  std::optional<TimePoint> report_miss(TimePoint now) noexcept override;

  void refuse_when_frozen(const char* what) const;
  void add_group(const std::shared_ptr<CallbackGroup>& group, const Node& node);
  void add_entity(const std::shared_ptr<Entity>& entity, const Node& node);
  void listen_to(const std::shared_ptr<Node>& node);

  // With the mutex held.
  void choose_wait_backend() TAKT_REQUIRES(mutex_);
  std::unique_ptr<Record> make_record(const std::shared_ptr<Entity>& entity, const Node& node,
                                      const CallbackParameters& parameters) TAKT_REQUIRES(mutex_);
  void undo_add(Record& record) noexcept TAKT_REQUIRES(mutex_);
  void publish() TAKT_REQUIRES(mutex_);
  void publish_removal() noexcept TAKT_REQUIRES(mutex_);
  bool begin_removal(const std::vector<Record*>& records) noexcept;
  void end_removal(const std::vector<Record*>& records, bool at_rest) noexcept;
  bool claim_removal(Record& record) noexcept TAKT_REQUIRES(mutex_);
  void take_from_lists(Record& record) noexcept TAKT_REQUIRES(mutex_);
  void remove_at_rest(const std::vector<Record*>& records) noexcept TAKT_REQUIRES(mutex_);
  RemovedRecords take_unused() noexcept TAKT_REQUIRES(mutex_);

  const ExecutorOptions& options_;
  Dispatcher& dispatcher_;
  Removals removals_;
  mutable RankedMutex<LockRank::callback_lists> mutex_;  // guards all below
  bool is_spinning_ TAKT_GUARDED_BY(mutex_) = false;
  bool is_frozen_ TAKT_GUARDED_BY(mutex_) = false;
  CallbackRecords records_ TAKT_GUARDED_BY(mutex_);
  std::unordered_map<const Entity*, Record*> of_entity_ TAKT_GUARDED_BY(mutex_);  // the same
  RemovedRecords removed_ TAKT_GUARDED_BY(mutex_);  // until nothing refers to them
  Changes changes_ TAKT_GUARDED_BY(mutex_);
  CallbackId next_id_ TAKT_GUARDED_BY(mutex_) = 0;
  Numbers<Exclusion> group_ids_ TAKT_GUARDED_BY(mutex_);
  Numbers<const Node> node_ids_ TAKT_GUARDED_BY(mutex_);
  std::vector<std::weak_ptr<Node>> nodes_ TAKT_GUARDED_BY(mutex_);
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_CALLBACKS_HPP_
