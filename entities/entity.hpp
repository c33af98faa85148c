// The interface that executors use: an entity becomes ready, is taken, and is executed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_ENTITY_HPP_
#define TAKT_ENTITIES_ENTITY_HPP_

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/callback_groups/callback_group.hpp"
#include "takt/transport/message_block.hpp"

namespace TAKT_PUBLIC takt {

struct Waiting;

/// Where an entity announces itself: an executor makes one for each of its entities.
/// Thread safety: every method from any thread; the comments name the lock that the caller holds.
/// Real-time: remove and wait_for_removal block; the rest neither blocks nor allocates.
class Sink : public ArrivalListener {
 public:
  /// The result of next_release() has changed. As announce.
  virtual void release_changed() noexcept = 0;
  /// Lets the entity go: afterwards no thread announces to this sink and, unless the call comes
  /// from the entity's own callback, none executes the entity. Blocks until then.
  virtual void remove() noexcept = 0;
  /// Announces a remove(), so that the sink lives until then. Called with ownership_mutex held.
  virtual void expect_remove() noexcept = 0;
  /// Another thread removes it already: announces a wait_for_removal(), so that the sink lives
  /// until then. Called with ownership_mutex held.
  virtual void expect_wait() noexcept {}
  /// Blocks as remove() does.
  virtual void wait_for_removal() noexcept {}
  /// Whether no thread announces to this sink any more. With ownership_mutex held.
  virtual bool is_detached() const noexcept { return true; }
  /// Whether messages need their publish time.
  virtual bool wants_time() const noexcept { return true; }

 protected:
  ~Sink() = default;
};

/// The file descriptor that a wait back end watches for an entity.
struct Watch {
  int fd = -1;                          // none
  short events = 0;                     // as poll(2) takes them
  ArrivalListener* listener = nullptr;  // notified of events of the kernel; perhaps too often
};

/// What `take` took; it belongs to the worker, so that a reentrant group's workers can take from
/// one entity at the same time. A subscription copies the message's envelope; others fill in what
/// they know of it.
struct Slot : Envelope {
  union {
    MessageBlock* message = nullptr;  // subscriptions: the worker's hold of it
    Waiting* waiting;                 // coroutines: the one to resume
  };
  bool more = false;        // there was more to take
  std::uint8_t events = 0;  // file descriptors: FileDescriptorEvents
};

/// The path of a chain instance: the callbacks that it has passed, as one number. 0 is the path
/// that has not begun. Each callback multiplies by kPathFactor and adds its mark, so two paths that
/// continue through the same callbacks stay distinct, see joined_root. The low byte
/// counts the callbacks, as the factor and every mark end in 01.
inline constexpr std::uint64_t kPathFactor = 0x9e3779b97f4a7c01;
constexpr std::uint64_t path_mark(std::uint64_t entity_id) noexcept {
  std::uint64_t mark = entity_id * 0x9e3779b97f4a7c15;  // splitmix64: spreads the bits
  mark = (mark ^ (mark >> 30)) * 0xbf58476d1ce4e5b9;
  mark = (mark ^ (mark >> 27)) * 0x94d049bb133111eb;
  return ((mark ^ (mark >> 31)) & ~std::uint64_t{0xff}) | 1;
}
constexpr std::uint64_t extend_path(std::uint64_t path, std::uint64_t mark) noexcept {
  return path * kPathFactor + mark;
}
/// The path that the callback with this mark extends to `path`.
constexpr std::uint64_t retract_path(std::uint64_t path, std::uint64_t mark) noexcept {
  constexpr std::uint64_t kInverse = 0xe84ee902acc58401;  // times kPathFactor, it is 1
  return (path - mark) * kInverse;
}
static_assert(retract_path(extend_path(5, path_mark(7)), path_mark(7)) == 5);

class StagedOutputs;
class ExecutionWatch;

/// The callback that the calling thread executes, and the chain instance it belongs to. `publish`
/// copies the latter into the message's envelope.
struct Dispatch {
  const CallbackInfo* callback;
  mutable std::uint64_t chain_instance;  // another one from where the callback joins, see ChainJoin
  TimePoint root_release;
  std::uint64_t path;                // this callback included
  StagedOutputs* outputs = nullptr;  // where messages wait for the end of the period; none: sent
  const Exclusion* group = nullptr;  // the callback's
  const Dispatch* outer = nullptr;   // whose callback spins the executor of this one

  /// nullptr outside callbacks.
  static const Dispatch* current() noexcept { return current_; }

  /// Makes a dispatch current for as long as the object lives.
  class Scope {
   public:
    explicit Scope(Dispatch& dispatch) noexcept : dispatch_(dispatch) {
      dispatch.outer = current_;
      current_ = &dispatch;
    }
    ~Scope() { current_ = dispatch_.outer; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    const Dispatch& dispatch_;
  };

 private:
  // Found without a call: with that of the worker, that would be 4 % of a callback without work.
  [[gnu::tls_model("initial-exec")]] static thread_local constinit const Dispatch* current_;
};

class Chain;

/// The place of a callback in a chain.
struct ChainStep {
  std::shared_ptr<Chain> chain;
  std::uint32_t position = 0;
  std::uint64_t path = 0;  // of the chain's instances, when they are here
  bool is_last = false;
};

/// Timer, subscription, guard condition and whatever else owns a callback. Readiness is both a
/// level (`ready_count`) and an edge (an announcement to the sink).
///
/// Thread safety: announce and the level from any thread; take and execute from one worker at a
/// time in an exclusive group, from several in a reentrant one.
/// Real-time: announce, ready_count, front and take neither block nor allocate; but `take` decodes
/// a message of another process, which may allocate, see SubscriptionBase::Memory.
class Entity {
 public:
  Entity(EntityKind kind, std::string name, std::shared_ptr<CallbackGroup> group);
  virtual ~Entity();
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;

  EntityKind kind() const noexcept { return kind_; }
  /// Unique in its node: "scan_timer", "scan" (the topic as the node wrote it), "scan#2" where the
  /// node has a subscription, service or client of this name already.
  const std::string& name() const noexcept { return name_; }
  const std::shared_ptr<CallbackGroup>& group() const noexcept { return group_; }
  /// From 1, over the process.
  std::uint64_t id() const noexcept { return id_; }
  /// Of this callback in the path of a chain instance.
  std::uint64_t mark() const noexcept { return mark_; }

  /// Its own parameters, which come before those of its group. Call it before an executor has the
  /// entity; afterwards see Node::set_callback_parameters. Throws Error if a value is invalid.
  void set_parameters(const CallbackParameters& parameters);
  const CallbackParameters& parameters() const noexcept { return parameters_; }
  /// Throws Error when an executor has it already.
  void join_chain(ChainStep step);
  /// Does not change while an executor has it.
  const std::vector<ChainStep>& chain_steps() const noexcept { return chain_steps_; }
  /// Its executions are compared with what an analysis has assumed. Before an executor has it.
  void set_execution_watch(std::shared_ptr<ExecutionWatch> watch) noexcept {
    watch_ = std::move(watch);
  }
  /// nullptr: they are not.
  const std::shared_ptr<ExecutionWatch>& execution_watch() const noexcept { return watch_; }

  /// How often it can be taken now; an upper bound.
  virtual std::size_t ready_count() const noexcept = 0;
  /// The arrival of what would be taken next; false when that is not known.
  virtual bool front(Arrival& arrival) const noexcept;
  /// Timers: when it becomes ready by itself, kNever while cancelled.
  virtual std::optional<TimePoint> next_release() const noexcept { return std::nullopt; }
  /// File descriptors: what has to be watched, so that it announces itself.
  virtual Watch watch() noexcept { return {}; }
  virtual Nanoseconds period() const noexcept { return Nanoseconds::zero(); }

  /// Takes one message, release or event into the slot. False: there was none to take.
  virtual bool take(Slot& slot) noexcept = 0;
  /// Whether `take` is a few instructions, so that an executor may call it under a lock.
  virtual bool takes_briefly() const noexcept { return false; }
  /// Calls the user's callback with what was taken. The user may throw.
  virtual void execute(Slot& slot) = 0;
  /// Throws away what was taken.
  virtual void discard(Slot&) noexcept {}
  /// Timers: how many releases may wait, 1 at least.
  virtual void set_most_releases(std::uint32_t) noexcept {}
  /// Timers: releases that have come by then are not served but counted as missed.
  virtual void skip_releases(TimePoint) noexcept {}

  /// The topic or service whose messages it takes; empty for all others.
  virtual const std::string& topic() const noexcept;
  /// Counts for results beside those of the executor, since it was made.
  struct Counts {
    std::uint64_t expected = 0;      // messages sent to it, as far as this process knows
    std::uint64_t from_outside = 0;  // of these, messages that came from other processes
    std::uint64_t dropped = 0;       // overwritten before they were taken
    std::uint64_t missed = 0;        // timer releases that came while one was outstanding
  };
  virtual Counts counts() const noexcept { return {}; }
  /// Messages overwritten, or releases missed, so far.
  virtual std::uint64_t lost() const noexcept { return 0; }

  // For executors and wait sets.
  virtual void attach(Sink& sink) noexcept { sink_.store(&sink); }
  /// No announcement is under way when it returns.
  virtual void detach() noexcept;
  bool is_attached() const noexcept { return sink_.load() != nullptr; }
  /// The owner of the entity. With ownership_mutex held; the thread that resets the owner must call
  /// its remove(), so that of two threads that drop an entity at the same time only one removes it.
  void set_owner(Sink* owner) noexcept { owner_ = owner; }
  Sink* owner() const noexcept { return owner_; }
  /// Whether it can get an owner. With ownership_mutex held.
  bool is_free() const noexcept;
  /// Adds a former owner, which may still be in its callback. There may be several: a callback may
  /// give its own entity to another executor. With ownership_mutex held.
  void add_earlier_owner(Sink& owner) { earlier_owners_.push_back(&owner); }
  void forget_earlier_owner(const Sink& owner) noexcept { std::erase(earlier_owners_, &owner); }

  /// The counts when its last executor gave it back: the next one counts from there. Written while
  /// it is given back, read with ownership_mutex held afterwards.
  void set_answered(const Counts& counts) noexcept { answered_ = counts; }
  const Counts& answered() const noexcept { return answered_; }

  /// Takes it from its executor or wait set, if it has one, and waits as Sink::remove does.
  void leave_owner() noexcept;
  /// The user dropped the entity: as leave_owner, and no executor gets it again.
  virtual void retire() noexcept;
  /// With ownership_mutex held.
  bool is_retired() const noexcept { return is_retired_; }
  /// How long the thread that drops it waits, see NodeOptions.
  Nanoseconds drop_wait() const noexcept { return drop_wait_; }
  /// After that, when the last pointer goes: what still uses the entity may keep it.
  virtual void retired(std::shared_ptr<Entity>) noexcept {}

 protected:
  void announce(const Arrival& arrival) noexcept {
    Sink* sink = sink_.load();
    if (sink != nullptr) sink->announce(arrival);
  }
  Sink* sink() const noexcept { return sink_.load(); }

 private:
  friend class Node;

  const EntityKind kind_;
  std::string name_;  // Node numbers the second of one name, before others know it
  const std::shared_ptr<CallbackGroup> group_;
  const std::uint64_t id_;
  const std::uint64_t mark_;
  CallbackParameters parameters_;
  std::vector<ChainStep> chain_steps_;
  std::shared_ptr<ExecutionWatch> watch_;
  std::atomic<Sink*> sink_{nullptr};
  Counts answered_;
  // Guarded by ownership_mutex.
  Sink* owner_ = nullptr;
  std::vector<Sink*> earlier_owners_;
  Nanoseconds drop_wait_ = Nanoseconds::max();  // set before an executor has it
  bool is_retired_ = false;
};

/// Guards the owner of each entity, over the whole process: taken for a few instructions when
/// entities and executors come and go, never while something waits or runs.
PiMutex& ownership_mutex() noexcept;

}  // namespace takt

#endif  // TAKT_ENTITIES_ENTITY_HPP_
