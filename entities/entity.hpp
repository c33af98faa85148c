// What an executor sees: something that becomes ready, is taken, and is executed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_ENTITY_HPP_
#define TAKT_ENTITIES_ENTITY_HPP_

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/time.hpp"
#include "takt/callback_groups/callback_group.hpp"
#include "takt/transport/message_block.hpp"

namespace takt {

/// Where an entity announces itself: an executor makes one for each of its entities.
class Sink {
 public:
  /// The entity became ready. Any thread, inside a read section; neither blocks nor allocates.
  virtual void announce(const Arrival& arrival) noexcept = 0;
  /// The time that next_release() tells has changed. As above.
  virtual void release_changed() noexcept = 0;
  /// Lets the entity go: afterwards nobody announces to this sink and, unless the call comes from
  /// the entity's own callback, nobody executes the entity. Blocks until then.
  virtual void remove() noexcept = 0;
  /// Announces a remove(), so that the sink lives until then. Called with ownership_mutex held.
  virtual void expect_remove() noexcept = 0;
  /// Whether messages need their publish time.
  virtual bool wants_time() const noexcept { return true; }

 protected:
  ~Sink() = default;
};

/// What `take` took; it belongs to the worker, so that a reentrant group's workers can take from
/// one entity at the same time.
struct Slot {
  MessageBlock* message = nullptr;   // subscriptions: the worker's hold of it
  bool more = false;                 // there was more to take
  std::uint64_t sequence = 0;        // order of arrival
  TimePoint ready_time{};            // when it was published or due
  TimePoint root_release{};          // when the chain's first callback was; {} at the first
  std::uint64_t chain_instance = 0;  // 0: this is the first
  Nanoseconds expected_period{0};    // of the publisher or timer, 0 unknown
};

/// The callback that the calling thread executes, and the chain instance it belongs to. `publish`
/// copies the latter into the message's envelope.
struct Dispatch {
  const CallbackInfo* callback;
  std::uint64_t chain_instance;
  TimePoint root_release;

  /// nullptr outside callbacks.
  static const Dispatch* current() noexcept { return current_; }

  /// Makes a dispatch current for as long as the object lives.
  class Scope {
   public:
    explicit Scope(const Dispatch& dispatch) noexcept : outer_(current_) { current_ = &dispatch; }
    ~Scope() { current_ = outer_; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    const Dispatch* outer_;
  };

 private:
  [[gnu::tls_model("initial-exec")]] static thread_local constinit const Dispatch* current_;
};

/// Timer, subscription, guard condition and whatever else owns a callback. Readiness is both a
/// level (`ready_count`) and an edge (an announcement to the sink).
///
/// Thread safety: announce and the level from any thread; take and execute from one worker at a
/// time in an exclusive group, from several in a reentrant one.
/// Real-time: announce, ready_count, front and take neither block nor allocate.
class Entity {
 public:
  Entity(EntityKind kind, std::string name, std::shared_ptr<CallbackGroup> group);
  virtual ~Entity() = default;
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;

  EntityKind kind() const noexcept { return kind_; }
  /// Unique in its node: "scan_timer", "scan" (the topic as the node wrote it).
  const std::string& name() const noexcept { return name_; }
  const std::shared_ptr<CallbackGroup>& group() const noexcept { return group_; }

  /// How often it can be taken now; an upper bound.
  virtual std::size_t ready_count() const noexcept = 0;
  /// The arrival of what would be taken next; false when that is not known.
  virtual bool front(Arrival& arrival) const noexcept;
  /// Timers: when it becomes ready by itself, kNever while cancelled.
  virtual std::optional<TimePoint> next_release() const noexcept { return std::nullopt; }
  virtual int fd() const noexcept { return -1; }
  virtual Nanoseconds period() const noexcept { return Nanoseconds::zero(); }

  /// Takes one piece of readiness into the slot. False: there was none, which is no execution.
  virtual bool take(Slot& slot) noexcept = 0;
  /// Calls the user's callback with what was taken. The user may throw.
  virtual void execute(Slot& slot) = 0;

  /// What a report says beyond the executor's own counts.
  struct Report {
    std::string topic;
    std::uint64_t expected = 0;  // messages sent to it
    std::uint64_t dropped = 0;   // overwritten before they were taken
    std::uint64_t missed = 0;    // timer releases that came while one was outstanding
  };
  virtual Report report() const { return {}; }

  // For executors and wait sets.
  virtual void attach(Sink& sink) noexcept { sink_.store(&sink); }
  /// No announcement is under way when it returns.
  virtual void detach() noexcept;
  bool is_attached() const noexcept { return sink_.load() != nullptr; }
  /// Whose entity it is. With ownership_mutex held; who resets the owner must call its remove(),
  /// so that of two who let an entity go at the same time only one does the work.
  void set_owner(Sink* owner) noexcept { owner_ = owner; }
  Sink* owner() const noexcept { return owner_; }

  /// The user let go of the entity: takes it from its executor, and waits as Sink::remove does.
  virtual void retire() noexcept;

 protected:
  void announce(const Arrival& arrival) noexcept {
    if (Sink* sink = sink_.load()) sink->announce(arrival);
  }
  Sink* sink() const noexcept { return sink_.load(); }

 private:
  const EntityKind kind_;
  const std::string name_;
  const std::shared_ptr<CallbackGroup> group_;
  std::atomic<Sink*> sink_{nullptr};
  Sink* owner_ = nullptr;  // guarded by ownership_mutex
};

/// Guards who owns which entity, over the whole process: taken for a few instructions when
/// entities and executors come and go, never while something waits or runs.
PiMutex& ownership_mutex() noexcept;

}  // namespace takt

#endif  // TAKT_ENTITIES_ENTITY_HPP_
