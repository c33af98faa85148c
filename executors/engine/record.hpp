// What an executor keeps of one callback.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_RECORD_HPP_
#define TAKT_EXECUTORS_ENGINE_RECORD_HPP_

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/thread_safety.hpp"
#include "takt/entities/entity.hpp"
#include "takt/executors/engine/observed.hpp"
#include "takt/executors/engine/record_state.hpp"
#include "takt/executors/executor.hpp"
#include "takt/sched/scheduler.hpp"

namespace takt::detail {

class Callbacks;
class Dispatcher;

/// The fields that each dispatch of a callback writes, in one cache line, as another worker may
/// have had it last. Publishers read none of it (no false sharing). Serialised by the executor, but
/// for the state.
struct alignas(64) DispatchState : ReadyCallback {
  RecordState state;
};
static_assert(sizeof(DispatchState) == 64);

/// All that an executor keeps of one entity. A control thread creates it when the entity is added.
/// Fields without a comment never change, or are serialised by the executor.
struct CallbackRecord final : DispatchState, Observed, Sink {
  CallbackRecord(Callbacks& owner, Dispatcher& by, std::shared_ptr<Entity> of, const Node& node,
                 const CallbackParameters& parameters);

  Dispatcher& dispatcher;
  Callbacks& callbacks;
  std::shared_ptr<Exclusion> exclusion;  // shared by the group
  CallbackInfo demoted_info;             // as settings.info, but less urgent than all others
  bool takes_briefly = false;            // Entity::takes_briefly
  // Guarded by the mutex of the lists.
  CallbackSettings wanted;      // from the next update on
  bool is_handed_over = false;  // to the ready set, by an update
  bool is_watched = false;      // its file descriptor

  std::atomic<bool> is_held{false};  // by the rule, perhaps for ever

  // Publishers read the mark, and the publisher that sets it writes the rest: a cache line of its
  // own, which dispatches seldom write.
  alignas(64) RecordState::Mark is_announced{false};
  Arrival announced{};
  CallbackRecord* inbox_next = nullptr;
  std::atomic<WorkerSet> workers{~WorkerSet{}};  // as in its settings
  std::atomic<std::uint32_t> level{UINT32_MAX};  // see WorkersPolicy::levels

  void arrived(const Arrival& arrival) noexcept {
    sequence = arrival.sequence;
    ready_time = arrival.ready_time;
    root_ready_time = arrival.root_time != TimePoint{} ? arrival.root_time : arrival.ready_time;
  }
  /// Applies the settings. The record must be in no scheduler.
  void set(const CallbackSettings& settings) noexcept;
  /// Sets the urgency and deadline that schedulers see: again when the callback is demoted or no
  /// longer so, and for each release with a deadline.
  void set_urgency() noexcept;
  // Called by the entity, whose sink the record is.
  void announce(const Arrival& arrival) noexcept override;
  bool takes_here() const noexcept override;
  void release_changed() noexcept override;
  void remove() noexcept override;
  void expect_remove() noexcept override;
  void expect_wait() noexcept override;
  void wait_for_removal() noexcept override;
  bool is_detached() const noexcept override { return state.is_detached(); }
  bool wants_time() const noexcept override;

  // The end of its life.

  /// A removed record has left one place of the ready set: the lists that an update replaces, an
  /// execution, or the inbox. Leaving the last one drops the ready set's reference, so the caller
  /// must not use the record afterwards.
  void leave() noexcept;
  /// For a record that was never handed over: the ready set does not know it.
  void remove_unpublished() noexcept;
  /// Waits until the record is removed and no execution is left, except where that would be a
  /// deadlock (see the source). False: `at_most` has passed before.
  bool wait_until_over(Nanoseconds at_most = Nanoseconds::max()) const noexcept;
  /// The first thread detaches the entity, the others wait for that.
  void detach() noexcept;
  /// True: no thread uses the record, and none begins to wait for it any more.
  bool may_be_freed() noexcept;
  /// Makes this record the owner of its entity, which must be free. With ownership_mutex held.
  void own_entity() noexcept;
  /// With ownership_mutex held.
  void forget_earlier_owner() noexcept { entity->forget_earlier_owner(*this); }

  CallbackId key() const noexcept { return wanted.info.id; }  // as id(), for control threads
  bool is_described_by(const CallbackInfo* of) const noexcept {
    return of == &settings.info || of == &demoted_info;
  }
  bool is_reentrant() const noexcept { return exclusion->is_reentrant(); }
};

using CallbackRecords = std::map<CallbackId, std::unique_ptr<CallbackRecord>>;  // by registration
using RemovedRecords = std::vector<std::unique_ptr<CallbackRecord>>;

/// The records of an executor, and removed ones until nothing refers to them.
struct CallbackLists {
  mutable RankedMutex<LockRank::callback_lists> mutex;  // guards all below
  CallbackRecords records TAKT_GUARDED_BY(mutex);
  RemovedRecords removed TAKT_GUARDED_BY(mutex);
  bool is_spinning TAKT_GUARDED_BY(mutex) = false;
};

/// What a worker knows of a callback from when it has picked it until it has run.
struct Execution {
  /// `has_times`: its begin and end are measured, and reported to the scheduler and the rule.
  Execution(CallbackRecord& picked, bool has_times)
      : record(&picked), info(picked.info), is_checked(picked.is_checked) {
    slot.sequence = picked.sequence;
    if (has_times) as_picked.emplace(AsPicked{picked, picked.settings.label});
  }
  struct AsPicked {
    ReadyCallback callback;
    std::uint64_t label;  // of the rule
  };
  CallbackRecord* record;
  const CallbackInfo* info;  // this and the fields below: as it was picked
  std::optional<AsPicked> as_picked;
  bool is_checked;
  bool is_dropped = false;  // set only where it is checked
  bool is_taken = false;
  Slot slot;
};

/// For rules and workers' policies.
NamedCallback named(const CallbackRecord& record, const CallbackInfo& info) noexcept;

/// The wanted settings, with the parameters that the callback has in its node now. Throws what a
/// user's rule or workers' policy throws.
CallbackSettings settings_of(const CallbackRecord& record, const Node& node);

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_RECORD_HPP_
