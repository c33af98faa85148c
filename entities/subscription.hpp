// Receives messages of one type from one topic.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_SUBSCRIPTION_HPP_
#define TAKT_ENTITIES_SUBSCRIPTION_HPP_

#include <atomic>
#include <concepts>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

#include "takt/base/lockfree/cells.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/entities/task_runner.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

struct Tracepoints;

/// The part of a subscription that does not depend on the message's type.
/// Thread safety and real-time: as Entity and IntraProcessReader.
class SubscriptionBase : public Entity, public IntraProcessReader {
 public:
  /// The memory of what callbacks hold; beyond it, they allocate.
  struct Memory {
    const MessageMaker* maker = nullptr;
    std::size_t messages = 0;  // decoded ones from other processes, and copies
    std::size_t shared = 0;    // shared_ptrs that `share` makes
    bool copies = false;
  };
  /// `participant`: receives from other processes too; may be nullptr.
  SubscriptionBase(EntityKind kind, const std::string& name,
                   const std::shared_ptr<CallbackGroup>& group, const Endpoint& endpoint,
                   const std::shared_ptr<Participant>& participant, const Memory& memory);
  ~SubscriptionBase() override;

  const std::string& topic() const noexcept override { return endpoint().topic; }
  const QoS& qos() const noexcept { return endpoint().qos; }
  std::size_t ready_count() const noexcept override;
  bool front(Arrival& arrival) const noexcept override;
  using Entity::take;
  bool take(Slot& slot) noexcept override;
  void discard(Slot& slot) noexcept override;
  void attach(Sink& sink) noexcept override;
  void detach() noexcept override;
  void retire() noexcept override;
  Counts counts() const noexcept override;
  std::uint64_t lost() const noexcept override;
  /// Publishers in other processes.
  std::size_t outside_publisher_count() const noexcept {
    return ask_outside(&RemoteReader::writer_count);
  }
  /// Starts to receive messages.
  void start();

 protected:
  /// The oldest message, decoded, which the caller must release; nullptr when there is none, or it
  /// was not what its type says: that is counted as dropped.
  MessageBlock* take_message(bool& more) noexcept {
    return decoded(IntraProcessReader::take(more));
  }
  /// For a caller with a lock, which `released` outlives.
  MessageBlock* take_message(bool& more, ReleasedMessages& released) noexcept {
    return decoded(IntraProcessReader::take(more, released));
  }
  /// The message as a shared_ptr, which takes the caller's hold of it over.
  std::shared_ptr<const void> share(MessageBlock& message);
  /// One to be filled in for a callback; nullptr: all are out.
  LoanedBlock* place_for_copy() noexcept { return messages_->acquire(); }
  /// For a taker that may take again, after it might not.
  void announce_if_ready() noexcept;

 private:
  MessageBlock* decoded(MessageBlock* message) noexcept {
    const bool is_decoded = message == nullptr || message->payload() != nullptr;
    return is_decoded ? message : decode_received(*message);
  }
  [[gnu::noinline]] MessageBlock* decode_received(MessageBlock& received) noexcept;
  [[gnu::cold, gnu::noinline]] void trace_take(const Tracepoints& points,
                                               const MessageBlock& message) const noexcept;
  /// The message that these bytes are, or nullptr.
  MessageBlock* decode(std::span<const std::byte> bytes) noexcept;
  /// The remote reader may go meanwhile: a callback may drop what another one answers for.
  template <class Number>
  Number ask_outside(Number (RemoteReader::*question)() const noexcept) const noexcept {
    const ReadSection section;
    const RemoteReader* const remote = remote_.load();
    return remote != nullptr ? (remote->*question)() : 0;
  }

  const std::shared_ptr<Participant> participant_;
  std::unique_ptr<RemoteReader> own_remote_;
  std::atomic<const RemoteReader*> remote_{nullptr};  // the same, for other threads
  std::atomic<std::uint64_t> malformed_{0};
  const MessageMaker* const maker_;
  const PoolPtr<LoanedBlock> messages_;  // nullptr: there is nothing to make
  const std::unique_ptr<const Cells> control_blocks_;
};

/// Information about a message, as an optional second argument of callbacks.
struct MessageInfo {
  std::uint64_t sequence;  // order of publication, over the process
  TimePoint publish_time;  // {} when the executor's statistics are not full
  TimePoint root_release;  // of the chain's first callback; {} outside chains
  /// Of a message from another process: when that one published it, by its own wall clock; else {}.
  std::chrono::system_clock::time_point source_time;
  /// The same number for all messages of one publisher in another process; 0: one of this process.
  std::uint64_t writer;

  explicit MessageInfo(const Slot& slot) noexcept
      : sequence(slot.sequence),
        publish_time(slot.ready_time),
        root_release(slot.root_release),
        source_time(slot.message->origin.source_time),
        writer(slot.message->origin.writer) {}
};

/// A subscription, as its node creates it. Dropping the last pointer removes it from its executor
/// and waits for its running callback (unless dropped in that very callback).
/// Thread safety and real-time: as SubscriptionBase.
template <Message T>
class Subscription : public SubscriptionBase {
 public:
  using SharedPtr = std::shared_ptr<Subscription>;

  /// The rest as in SubscriptionBase::Memory.
  Subscription(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
               const Endpoint& endpoint, const std::shared_ptr<Participant>& participant,
               std::size_t messages, std::size_t shared = 0, bool copies = false)
      : SubscriptionBase(EntityKind::subscription, name, group, endpoint, participant,
                         {&kMakerOf<T>, messages, shared, copies}) {}
  using SubscriptionBase::take;

  /// Takes the oldest message by copy, without an executor (WaitSet). False when there is none.
  virtual bool take(T& message) {
    bool more;
    const HeldMessage held(take_message(more));
    if (held == nullptr) return false;
    message = *static_cast<const T*>(held->payload());
    return true;
  }
};

/// The forms of callback: how it takes the message, and whether MessageInfo follows.
template <class F, class T>
concept SubscriptionCallback =
    std::invocable<F&, const T&> || std::invocable<F&, std::shared_ptr<const T>> ||
    std::invocable<F&, std::unique_ptr<T>> || std::invocable<F&, const T&, const MessageInfo&> ||
    std::invocable < F&,
        std::shared_ptr<const T>,
const MessageInfo& > || std::invocable<F&, std::unique_ptr<T>, const MessageInfo&>;

/// A subscription with its callback. A callback that takes
/// - `const T&` reads the message; it never costs an allocation or a copy;
/// - `std::shared_ptr<const T>` may keep it; no allocation while it keeps at most depth + 16;
/// - `std::shared_ptr<T>` may also change it: it is the message itself when it came to this
///   subscription alone (or last) by unique_ptr, by copy, or from another process, else a copy; no
///   allocation while it keeps at most depth + 16, but for strings and vectors that grow;
/// - `std::unique_ptr<T>` owns it: moved out when it came by unique_ptr to this subscription
///   alone (or last), else moved or copied to the heap.
/// Thread safety and real-time: as Subscription, with the allocations named above.
template <Message T, SubscriptionCallback<T> F>
class CallbackSubscription : public Subscription<T> {
  static constexpr bool kLooks =
      std::invocable<F&, const T&> || std::invocable<F&, const T&, const MessageInfo&>;
  // A unique_ptr converts to a shared_ptr, so a callback that takes a shared_ptr would take both.
  static constexpr bool kShares =
      !kLooks && (std::invocable<F&, const std::shared_ptr<const T>&> ||
                  std::invocable<F&, const std::shared_ptr<const T>&, const MessageInfo&>);
  static constexpr bool kChanges =
      !kLooks && !kShares &&
      (std::invocable<F&, const std::shared_ptr<T>&> ||
       std::invocable<F&, const std::shared_ptr<T>&, const MessageInfo&>);
  using Argument = std::conditional_t<
      kLooks, const T&,
      std::conditional_t<kShares, std::shared_ptr<const T>,
                         std::conditional_t<kChanges, std::shared_ptr<T>, std::unique_ptr<T>>>>;

 public:
  static constexpr bool kIsTask =
      TaskCallback<F, Argument> || TaskCallback<F, Argument, const MessageInfo&>;

  CallbackSubscription(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
                       const Endpoint& endpoint, F callback,
                       const std::shared_ptr<Participant>& participant = nullptr)
      : Subscription<T>(name, group, endpoint, participant,
                        kLooks                ? 4
                        : kShares || kChanges ? endpoint.qos.depth + 16
                                              : 0,
                        kShares || kChanges ? endpoint.qos.depth + 16 : 0, kChanges),
        callback_(std::move(callback)) {}
  using Subscription<T>::take;

  void execute(Slot& slot) override {
    MessageBlock& block = *slot.message;
    const MessageInfo info(slot);
    if constexpr (kIsTask) {
      std::abort();  // see TaskSubscription
    } else if constexpr (kLooks) {
      const Hold hold{block};
      call(*static_cast<const T*>(block.payload()), info);
    } else if constexpr (kShares) {
      call(std::static_pointer_cast<const T>(this->share(block)), info);
    } else if constexpr (kChanges) {
      call(changeable(block), info);
    } else {
      call(own(block), info);
    }
  }

 protected:
  /// The callback as a task, which holds the message.
  Task<> task(const Slot& slot) {
    const MessageInfo info(slot);
    MessageBlock& block = *slot.message;
    if constexpr (kLooks) {
      return look(TakenMessage<T>(&block, static_cast<const T*>(block.payload())), info);
    } else if constexpr (kShares) {
      return pass(std::static_pointer_cast<const T>(this->share(block)), info);
    } else if constexpr (kChanges) {
      return pass(changeable(block), info);
    } else {
      return pass(own(block), info);
    }
  }

 private:
  Task<> look(TakenMessage<T> message, MessageInfo info) { co_await call(*message, info); }
  Task<> pass(Argument message, MessageInfo info) { co_await call(std::move(message), info); }

  struct Hold {  // releases the message when the callback returns or throws
    MessageBlock& block;
    ~Hold() { block.release(); }
  };

  auto call(Argument message, const MessageInfo& info) {
    if constexpr (std::invocable<F&, Argument, const MessageInfo&>) {
      return callback_(std::forward<Argument>(message), info);
    } else {
      return callback_(std::forward<Argument>(message));
    }
  }

  std::unique_ptr<T> own(MessageBlock& block) {
    const Hold hold{block};
    if (void* message = block.steal()) return std::unique_ptr<T>(static_cast<T*>(message));
    const T& message = *static_cast<const T*>(block.payload());
    if (block.may_change()) return std::make_unique<T>(std::move(const_cast<T&>(message)));
    return std::make_unique<T>(message);
  }
  std::shared_ptr<T> changeable(MessageBlock& block) {
    HeldMessage held(&block);
    if (!block.may_change()) {
      const T& message = *static_cast<const T*>(block.payload());
      LoanedBlock* const place = this->place_for_copy();
      if (place == nullptr) return std::make_shared<T>(message);
      place->set_references(1);
      HeldMessage copy(place);
      *static_cast<T*>(place->message()) = message;
      held.swap(copy);
    }
    return std::static_pointer_cast<T>(std::const_pointer_cast<void>(this->share(*held.release())));
  }

  F callback_;
};

/// A subscription whose callback is a coroutine.
/// Thread safety and real-time: as CallbackSubscription and TaskRunner.
template <Message T, SubscriptionCallback<T> F>
class TaskSubscription : public CallbackSubscription<T, F>, private TaskOwner {
  using Base = CallbackSubscription<T, F>;

 public:
  using Base::Base;
  /// Before the first message.
  void set_runner(std::shared_ptr<TaskRunner> runner) {
    runner_ = std::move(runner);
    runner_->set_owner_of_tasks(*this);
  }

  std::size_t ready_count() const noexcept override {
    return runner_->is_free() ? Base::ready_count() : 0;
  }
  using Base::take;
  bool take(Slot& slot) noexcept override {
    if (!runner_->reserve()) return false;
    if (Base::take(slot)) return true;
    runner_->give_back();
    return false;
  }
  void execute(Slot& slot) override {
    runner_->start([&] { return this->task(slot); });
  }
  void discard(Slot& slot) noexcept override {
    Base::discard(slot);
    runner_->give_back();
  }
  void retire() noexcept override {
    Base::retire();
    runner_->retire();
  }
  void retired(std::shared_ptr<Entity> self) noexcept override { runner_->keep(std::move(self)); }

 private:
  void task_ended() noexcept override { this->announce_if_ready(); }

  std::shared_ptr<TaskRunner> runner_;
};

/// The type of a subscription with this callback.
template <Message T, SubscriptionCallback<T> F>
using SubscriptionWith = std::conditional_t<CallbackSubscription<T, F>::kIsTask,
                                            TaskSubscription<T, F>, CallbackSubscription<T, F>>;

}  // namespace takt

#endif  // TAKT_ENTITIES_SUBSCRIPTION_HPP_
