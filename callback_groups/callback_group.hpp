// Callback groups: decide whether callbacks may run at the same time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CALLBACK_GROUPS_CALLBACK_GROUP_HPP_
#define TAKT_CALLBACK_GROUPS_CALLBACK_GROUP_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "takt/base/visibility.hpp"
#include "takt/callback_groups/callback_parameters.hpp"
#include "takt/sched/scheduler.hpp"

namespace TAKT_PUBLIC takt {

enum class CallbackGroupType {
  MutuallyExclusive,  // one callback of the group at a time
  Reentrant,          // any number at a time, also of one entity
};

/// A set of callbacks with one rule about running at the same time. An entity points to its
/// group; the group knows no entities. It belongs to one executor at a time, which keeps an
/// `Exclusion` for it.
///
/// Thread safety: parameters are set before an executor has the group; the rest from any thread.
/// Real-time: set-up only; claim, release and the getters neither block nor allocate.
class CallbackGroup {
 public:
  using SharedPtr = std::shared_ptr<CallbackGroup>;

  CallbackGroup(std::string name, CallbackGroupType type, bool automatically_add_to_executor = true)
      : name_(std::move(name)),
        type_(type),
        automatically_add_to_executor_(automatically_add_to_executor) {}

  const std::string& name() const noexcept { return name_; }
  CallbackGroupType type() const noexcept { return type_; }
  /// Whether `Executor::add_node` takes the group along.
  bool automatically_add_to_executor() const noexcept { return automatically_add_to_executor_; }

  /// Call it before an executor has the group; afterwards see Node::set_callback_parameters. Throws
  /// Error if a value is invalid.
  void set_parameters(const CallbackParameters& parameters) {
    parameters.check();
    parameters_ = parameters;
  }
  const CallbackParameters& parameters() const noexcept { return parameters_; }

  // For executors.

  /// Makes the group this owner's; false when it has one already.
  bool claim(const void* owner) noexcept;
  void release(const void* owner) noexcept;
  bool belongs_to(const void* owner) const noexcept { return owner_.load() == owner; }

 private:
  const std::string name_;
  const CallbackGroupType type_;
  const bool automatically_add_to_executor_;
  CallbackParameters parameters_;
  std::atomic<const void*> owner_{nullptr};
};

/// The executor's data about a group: whether one of its callbacks runs, and the callbacks that
/// wait for it. A callback that cannot run now is parked here, in a scheduler of the executor's
/// type; when the running callback leaves the group, only the first parked one becomes ready again.
/// So a busy group causes no wake-ups and keeps the order. It is destroyed with the last of the
/// group's callbacks that the executor has, so an executor that removes a group late does not
/// affect the next executor's data. It has a cache line of its own, as another worker may dispatch
/// the next group at the same time.
///
/// Thread safety: none; the executor serialises it.
/// Real-time: admit and leave cost one push or pop of the scheduler.
class alignas(64) Exclusion {
 public:
  explicit Exclusion(CallbackGroupType type) : type_(type) {}

  /// Empties the parking place: what was parked, linked by `next`, in its order.
  ReadyCallback* take_parked() noexcept {
    ReadyCallback* first = nullptr;
    for (ReadyCallback** end = &first; parked_ != 0; --parked_) {
      *end = parking_->pop();
      (*end)->next = nullptr;
      end = &(*end)->next;
    }
    return first;
  }
  /// Gives it, whose parking place is empty, another one. The old one is returned.
  std::unique_ptr<Scheduler> set_parking(std::unique_ptr<Scheduler> parking) noexcept {
    return std::exchange(parking_, std::move(parking));
  }
  void park(ReadyCallback& callback) noexcept {
    parking_->push(callback);
    ++parked_;
  }
  /// True: the callback may run now; it leaves an exclusive group with `leave`. False: it is
  /// parked.
  bool admit(ReadyCallback& callback) noexcept {
    if (is_reentrant()) return true;
    if (busy_) {
      park(callback);
      return false;
    }
    return busy_ = true;
  }
  /// The highest preemption level in the group, see WorkersPolicy::levels.
  std::uint32_t ceiling() const noexcept { return ceiling_; }
  void set_ceiling(std::uint32_t ceiling) noexcept { ceiling_ = ceiling; }
  /// Whether it would admit a callback now.
  bool is_free() const noexcept { return !busy_; }
  bool is_reentrant() const noexcept { return type_ == CallbackGroupType::Reentrant; }
  /// An exclusive group's callback has run. Returns a parked callback that may compete again.
  ReadyCallback* leave() noexcept {
    busy_ = false;
    return unpark();
  }
  /// The parked callback that may compete again, when the group is free. Also called when the
  /// callback that it returned last was removed instead of run.
  ReadyCallback* unpark() noexcept {
    if (busy_ || parked_ == 0) return nullptr;
    --parked_;
    return parking_->pop();
  }

 private:
  const CallbackGroupType type_;
  bool busy_ = false;
  std::uint32_t ceiling_ = 0;
  std::size_t parked_ = 0;
  std::unique_ptr<Scheduler> parking_;
};

}  // namespace takt

#endif  // TAKT_CALLBACK_GROUPS_CALLBACK_GROUP_HPP_
