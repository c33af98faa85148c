// Timers and subscriptions of a LifecycleNode, which are paused while it is not active.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_MANAGED_ENTITIES_HPP_
#define TAKT_NODES_MANAGED_ENTITIES_HPP_

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "takt/base/clock.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/entities/timer.hpp"
#include "takt/nodes/callback_gate.hpp"

namespace TAKT_PUBLIC takt {

/// How a LifecycleNode notifies its managed entities. The gate alone decides whether they run;
/// these calls wake their listeners.
/// Thread safety: one call at a time; everything else of the entity meanwhile.
/// Real-time: a lock with priority inheritance at most; nothing allocates.
class Managed {
 public:
  virtual ~Managed() = default;
  virtual void opens() noexcept {}
  virtual void has_opened() noexcept = 0;
  virtual void has_closed() noexcept = 0;
};

/// An entity behind a gate: while that is closed it is never ready, and nothing is taken from it.
/// Thread safety and real-time: as Base and CallbackGate.
template <class Base>
class GatedEntity : public Base, public Managed {
 public:
  template <class... Arguments>
  explicit GatedEntity(std::shared_ptr<CallbackGate> gate, Arguments&&... arguments)
      : Base(std::forward<Arguments>(arguments)...), gate_(std::move(gate)) {}

  std::size_t ready_count() const noexcept override {
    return gate_->is_open() ? Base::ready_count() : 0;
  }
  using Base::take;
  bool take(Slot& slot) noexcept override {
    if (!gate_->reserve()) return false;
    if (Base::take(slot)) return true;
    gate_->give_back();
    return false;
  }
  void execute(Slot& slot) override {
    if (const CallbackGate::Passage passage(*gate_); passage) {
      Base::execute(slot);
    } else {
      Base::discard(slot);
    }
  }
  void discard(Slot& slot) noexcept override {
    Base::discard(slot);
    gate_->give_back();
  }

 protected:
  const CallbackGate& gate() const noexcept { return *gate_; }

 private:
  const std::shared_ptr<CallbackGate> gate_;
};

/// A timer of a LifecycleNode: while the node is not active it has no release, whatever reset and
/// release_at say; when the node becomes active, its phase begins, unless it is cancelled.
/// Thread safety and real-time: as GatedEntity.
template <std::derived_from<Timer> Base>
class ManagedTimer final : public GatedEntity<Base> {
 public:
  using GatedEntity<Base>::GatedEntity;

  std::optional<TimePoint> next_release() const noexcept override {
    return this->gate().is_open() ? Timer::next_release() : kNever;
  }
  void opens() noexcept override { this->restart(); }
  void has_opened() noexcept override { this->notify_release_changed(); }
  void has_closed() noexcept override { this->notify_release_changed(); }
};

/// Resumes the coroutines of a LifecycleNode: they continue when the node is active again.
/// Thread safety and real-time: as GatedEntity.
class ManagedTaskRunner final : public GatedEntity<TaskRunner> {
 public:
  using GatedEntity::GatedEntity;

  void has_opened() noexcept override { announce_if_ready(); }
  void has_closed() noexcept override {}
};

/// A subscription of a LifecycleNode: while the node is not active it keeps the newest messages, as
/// its depth says, and notifies no listener.
/// Thread safety and real-time: as GatedEntity; attach, detach and the changes of the gate take a
/// lock with priority inheritance.
template <Message T, class F>
class ManagedSubscription final : public GatedEntity<SubscriptionWith<T, F>> {
  using Base = GatedEntity<SubscriptionWith<T, F>>;

 public:
  template <class... Arguments>
  ManagedSubscription(std::shared_ptr<CallbackGate> gate, Clock& clock, Arguments&&... arguments)
      : Base(std::move(gate), std::forward<Arguments>(arguments)...), clock_(clock) {}

  using Base::take;
  bool take(T& message) override { return this->gate().is_open() && Base::take(message); }

  // The listener is set under the mutex, so that an executor that attaches and a node that becomes
  // active do not undo each other's change.
  void attach(Sink& sink) noexcept override {
    const std::lock_guard lock(mutex_);
    Base::attach(sink);
    if (!this->gate().is_open()) this->set_listener(nullptr);
  }
  void detach() noexcept override {
    const std::lock_guard lock(mutex_);
    Base::detach();
  }
  void has_opened() noexcept override {
    const std::lock_guard lock(mutex_);
    Sink* sink = this->sink();
    if (sink == nullptr) return;
    this->set_listener(sink);
    // Sequentially consistent: a sender announces from now on, and what was sent is seen here.
    if (this->ready_count() == 0) return;
    Arrival arrival{next_sequence(), clock_.now()};
    this->front(arrival);  // unless its publisher has not finished
    this->announce(arrival);
  }
  void has_closed() noexcept override {
    const std::lock_guard lock(mutex_);
    this->set_listener(nullptr);
  }
  /// Messages that wait for the node are not expected to have been received.
  Entity::Counts counts() const noexcept override {
    Entity::Counts counts = Base::counts();
    if (this->gate().is_open()) return counts;
    // The second number may have grown meanwhile.
    counts.expected -= std::min<std::uint64_t>(counts.expected, this->ring().size());
    return counts;
  }

 private:
  Clock& clock_;
  RankedMutex<LockRank::managed> mutex_;
};

}  // namespace takt

#endif  // TAKT_NODES_MANAGED_ENTITIES_HPP_
