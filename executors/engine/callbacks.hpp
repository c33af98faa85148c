// The callbacks of an executor: how they are added, changed and removed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_CALLBACKS_HPP_
#define TAKT_EXECUTORS_ENGINE_CALLBACKS_HPP_

#include <cstddef>
#include <memory>
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
class Callbacks final : private NodeListener {
 public:
  Callbacks(const ExecutorOptions& options, Dispatcher& dispatcher, CallbackLists& lists);
  /// Removes all callbacks.
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

  // For executors that are made of others.

  /// As remove_callback_group, for all of these groups that belong to this executor.
  void release_groups(std::vector<std::shared_ptr<CallbackGroup>> groups, Node& node,
                      bool with_node = false) noexcept;
  /// For a node of which nothing belongs to this executor any more. Afterwards the executor does
  /// not even lock its weak pointer, which might make it the node's last owner for a moment.
  void forget(Node& node) noexcept;
  /// Whether the executor has callbacks, or the node or one of its groups belongs to it. Callbacks
  /// may live longer than their node: then `node` is nullptr.
  bool is_used_by(const Node* node) const;
  /// When the first timer is due. Call it only while no thread spins; other threads may remove
  /// timers meanwhile.
  TimePoint next_release() const noexcept;

  /// The worker's thread begins to spin. Throws Error if another one does. `freezes`: nothing is
  /// added or removed afterwards.
  void begin_spin(Worker& worker, bool freezes);
  void end_spin(Worker& worker) noexcept;

  // For records.
  /// Removes the records. Waits for their running callbacks for `at_most`; after that another
  /// thread completes the removal.
  void remove(const std::vector<CallbackRecord*>& records,
              Nanoseconds at_most = Nanoseconds::max()) noexcept;
  Removals& removals() noexcept { return removals_; }

 private:
  using Record = CallbackRecord;

  void entity_added(Node& node, const std::shared_ptr<Entity>& entity) override;
  void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) override;
  void parameters_changed(Node& node) override;

  void refuse_when_frozen(const char* what) const;
  void add_group(const std::shared_ptr<CallbackGroup>& group, const Node& node);
  void add_entity(const std::shared_ptr<Entity>& entity, const Node& node);
  void listen_to(const std::shared_ptr<Node>& node);

  // With the mutex held.
  void choose_wait_backend() TAKT_REQUIRES(lists_.mutex);
  std::unique_ptr<Record> make_record(const std::shared_ptr<Entity>& entity, const Node& node,
                                      const CallbackParameters& parameters)
      TAKT_REQUIRES(lists_.mutex);
  void undo_add(Record& record) noexcept TAKT_REQUIRES(lists_.mutex);
  void publish(const std::vector<ScheduleUpdate::Change>& changed = {}) TAKT_REQUIRES(lists_.mutex);
  void begin_removal(const std::vector<Record*>& records) noexcept;
  void end_removal(const std::vector<Record*>& records) noexcept;
  bool claim_removal(Record& record) noexcept TAKT_REQUIRES(lists_.mutex);
  void take_from_lists(Record& record) noexcept TAKT_REQUIRES(lists_.mutex);
  RemovedRecords take_unused() noexcept TAKT_REQUIRES(lists_.mutex);

  const ExecutorOptions& options_;
  Dispatcher& dispatcher_;
  Removals removals_;
  CallbackLists& lists_;  // its mutex guards all below; `of_entity_`: its records by entity
  bool is_frozen_ TAKT_GUARDED_BY(lists_.mutex) = false;
  std::unordered_map<const Entity*, Record*> of_entity_ TAKT_GUARDED_BY(lists_.mutex);
  Changes changes_ TAKT_GUARDED_BY(lists_.mutex);
  CallbackId next_id_ TAKT_GUARDED_BY(lists_.mutex) = 0;
  Numbers<Exclusion> group_ids_ TAKT_GUARDED_BY(lists_.mutex);
  Numbers<const Node> node_ids_ TAKT_GUARDED_BY(lists_.mutex);
  std::vector<std::weak_ptr<Node>> nodes_ TAKT_GUARDED_BY(lists_.mutex);
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_CALLBACKS_HPP_
