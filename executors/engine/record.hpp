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

/// What each dispatch of a callback writes: one cache line, as another worker may have had it last,
/// which nothing shares that publishers read. Serialised by the executor, but for the state.
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
  bool takes_briefly = false;            // as its entity says
  // Guarded by the mutex of the lists.
  CallbackSettings wanted;      // from the next update on
  bool is_handed_over = false;  // to the ready set, by an update
  bool is_watched = false;      // its file descriptor

  std::atomic<bool> is_held{false};  // by the rule, perhaps for ever

  // Publishers read the mark, and the one that sets it writes the rest: a cache line that the
  // worker does not write each time.
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
  /// It must be in no scheduler.
  void set(const CallbackSettings& settings) noexcept;
  /// What schedulers see of it: again after it was or was no longer demoted, and for each release
  /// with a deadline.
  void set_urgency() noexcept;
  // As a sink.
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

  /// It has lost one of what keeps it in the ready set, if it is removed: the lists that an update
  /// replaces, an execution, or the inbox. The caller's last access then.
  void leave() noexcept;
  /// It was never handed over: nothing of the ready set has it.
  void remove_unpublished() noexcept;
  /// Waits until it is removed, and no execution is left; but see the source. False: it has not
  /// come to that in this time.
  bool wait_until_over(Nanoseconds at_most = Nanoseconds::max()) const noexcept;
  /// The first thread detaches the entity, the others wait for that.
  void detach() noexcept;
  /// True: no thread uses the record, and none begins to wait for it any more.
  bool may_be_freed() noexcept;
  /// The entity is free. With ownership_mutex held.
  void own_entity() noexcept;
  /// With ownership_mutex held.
  void forget_earlier_owner() noexcept { entity->forget_earlier_owner(*this); }

  CallbackId key() const noexcept { return wanted.info.id; }  // as id(), for control threads
  bool is_described_by(const CallbackInfo* of) const noexcept {
    return of == &settings.info || of == &demoted_info;
  }
  bool is_reentrant() const noexcept { return exclusion->is_reentrant(); }
};

using CallbackRecords = std::map<CallbackId, std::unique_ptr<CallbackRecord>>;  // as registered
using RemovedRecords = std::vector<std::unique_ptr<CallbackRecord>>;

/// Those that an executor has, and those that it had until nothing refers to them.
struct CallbackLists {
  mutable RankedMutex<LockRank::callback_lists> mutex;  // guards all below
  CallbackRecords records TAKT_GUARDED_BY(mutex);
  RemovedRecords removed TAKT_GUARDED_BY(mutex);
  bool is_spinning TAKT_GUARDED_BY(mutex) = false;
};

/// What a worker knows of a callback from when it has picked it until it has run.
struct Execution {
  /// `has_times`: when it begins and ends is read, and said to the scheduler and the rule.
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
  const CallbackInfo* info;  // it and what follows as it was picked
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
