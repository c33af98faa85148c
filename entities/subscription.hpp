// Receives messages of one type from one topic.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_SUBSCRIPTION_HPP_
#define TAKT_ENTITIES_SUBSCRIPTION_HPP_

#include <array>
#include <atomic>
#include <concepts>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/entities/task_runner.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

/// The part of a subscription that does not depend on the message's type.
/// Thread safety and real-time: as Entity and IntraProcessReader.
class SubscriptionBase : public Entity, public IntraProcessReader {
 public:
  /// `participant`: receives from other processes too; may be nullptr.
  SubscriptionBase(EntityKind kind, const std::string& name,
                   const std::shared_ptr<CallbackGroup>& group, const Endpoint& endpoint,
                   const std::shared_ptr<Participant>& participant);
  ~SubscriptionBase() override;

  const std::string& topic() const noexcept { return endpoint().topic; }
  const QoS& qos() const noexcept { return endpoint().qos; }
  std::size_t ready_count() const noexcept override { return ring().size(); }
  bool front(Arrival& arrival) const noexcept override;
  using Entity::take;
  bool take(Slot& slot) noexcept override;
  void discard(Slot& slot) noexcept override { slot.message->release(); }
  void attach(Sink& sink) noexcept override;
  void detach() noexcept override;
  void retire() noexcept override;
  Report report() const override;
  std::uint64_t lost() const noexcept override { return dropped() + malformed_; }
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
    MessageBlock* message = IntraProcessReader::take(more);
    if (message == nullptr || message->payload() != nullptr) return message;
    return decode_received(*message);
  }
  /// The message that these bytes are, or nullptr. Called by the thread that takes.
  virtual MessageBlock* decode(std::span<const std::byte> bytes) noexcept = 0;
  /// For a taker that may take again, after it might not.
  void announce_if_ready() noexcept;

 private:
  MessageBlock* decode_received(MessageBlock& received) noexcept;
  /// The end outside may go meanwhile: a callback may drop what another one answers for.
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

namespace detail {

/// Memory for the control blocks of the shared_ptrs that callbacks receive: a fixed number of
/// small cells; beyond that, and for larger requests, the heap.
/// Thread safety: allocators allocate and free from any thread.
/// Real-time: a cell is lock-free; the heap is not.
class ControlBlocks {
 public:
  static constexpr std::size_t kBytes = 64;
  struct Cell : PoolNode<Cell> {
    alignas(std::max_align_t) std::array<std::byte, kBytes> bytes;
    bool from_heap = false;
  };
  explicit ControlBlocks(std::size_t count);

  template <class U>
  struct Allocator {
    using value_type = U;
    Pool<Cell>* cells;
    explicit Allocator(Pool<Cell>* pool) noexcept : cells(pool) {}
    template <class V>
    Allocator(const Allocator<V>& other) noexcept : cells(other.cells) {}  // NOLINT: rebinding
    U* allocate(std::size_t count) {
      static_assert(sizeof(U) <= kBytes);
      Cell* cell = count == 1 ? cells->acquire() : nullptr;
      if (cell == nullptr) {
        cell = new Cell;
        cell->from_heap = true;
      }
      return reinterpret_cast<U*>(cell->bytes.data());
    }
    void deallocate(U* memory, std::size_t) noexcept {
      Cell* cell =
          reinterpret_cast<Cell*>(reinterpret_cast<std::byte*>(memory) - offsetof(Cell, bytes));
      if (cell->from_heap) {
        delete cell;
      } else {
        Pool<Cell>::recycle(*cell);
      }
    }
    friend bool operator==(const Allocator&, const Allocator&) = default;
  };
  template <class U>
  Allocator<U> allocator() const noexcept {
    return Allocator<U>(cells_.get());
  }

 private:
  PoolPtr<Cell> cells_;
};

/// The memory into which messages from other processes are decoded.
/// Thread safety: from any thread.
/// Real-time: a message that fits into the memory of one of the `kept` before it allocates nothing.
template <Message T>
class DecodedMessages {
 public:
  explicit DecodedMessages(std::size_t kept)
      : loans_(Pool<LoanedBlock<T>>::create(
            kept, [](std::uint32_t) { return std::make_unique<LoanedBlock<T>>(); })) {}

  /// nullptr when the bytes are no T.
  MessageBlock* decode(std::span<const std::byte> bytes) noexcept {
    const MessageType& type = message_type<T>();
    MessageBlock* block = nullptr;
    if (LoanedBlock<T>* loan = loans_->acquire()) {
      block = type.decode(bytes, &loan->message) ? loan : nullptr;
      if (block == nullptr) Pool<LoanedBlock<T>>::recycle(*loan);
    } else if (auto message = std::make_unique<T>(); type.decode(bytes, message.get())) {
      auto* owned = new OwnedBlock;
      owned->from_heap = true;
      owned->own(std::move(message));
      block = owned;
    }
    if (block != nullptr) block->set_references(1);
    return block;
  }

 private:
  PoolPtr<LoanedBlock<T>> loans_;
};

}  // namespace detail

/// A subscription, as its node creates it. Dropping the last pointer removes it from its executor
/// and waits for its running callback (unless dropped in that very callback).
/// Thread safety and real-time: as SubscriptionBase; a message from another process is decoded as
/// DecodedMessages says.
template <Message T>
class Subscription : public SubscriptionBase {
 public:
  using SharedPtr = std::shared_ptr<Subscription>;

  /// `kept`: how many messages from other processes callbacks hold at once.
  Subscription(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
               const Endpoint& endpoint, const std::shared_ptr<Participant>& participant,
               std::size_t kept)
      : SubscriptionBase(EntityKind::subscription, name, group, endpoint, participant),
        decoded_(participant != nullptr ? kept : 0) {}
  using SubscriptionBase::take;

  /// Takes the oldest message by copy, without an executor (WaitSet). False when there is none.
  virtual bool take(T& message) {
    bool more;
    MessageBlock* block = take_message(more);
    if (block == nullptr) return false;
    message = *static_cast<const T*>(block->payload());
    block->release();
    return true;
  }

 private:
  MessageBlock* decode(std::span<const std::byte> bytes) noexcept final {
    return decoded_.decode(bytes);
  }

  detail::DecodedMessages<T> decoded_;
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
/// - `std::unique_ptr<T>` owns it: moved out when it came by unique_ptr to this subscription
///   alone (or last), else copied to the heap.
/// Thread safety and real-time: as Subscription, with the allocations named above.
template <Message T, SubscriptionCallback<T> F>
class CallbackSubscription : public Subscription<T> {
  static constexpr bool kLooks =
      std::invocable<F&, const T&> || std::invocable<F&, const T&, const MessageInfo&>;
  // A unique_ptr converts to a shared_ptr, so a callback that takes a shared_ptr would take both.
  static constexpr bool kShares =
      !kLooks && (std::invocable<F&, const std::shared_ptr<const T>&> ||
                  std::invocable<F&, const std::shared_ptr<const T>&, const MessageInfo&>);
  using Argument =
      std::conditional_t<kLooks, const T&,
                         std::conditional_t<kShares, std::shared_ptr<const T>, std::unique_ptr<T>>>;

 public:
  static constexpr bool kIsTask =
      TaskCallback<F, Argument> || TaskCallback<F, Argument, const MessageInfo&>;

  CallbackSubscription(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
                       const Endpoint& endpoint, F callback,
                       const std::shared_ptr<Participant>& participant = nullptr)
      : Subscription<T>(name, group, endpoint, participant,
                        kLooks    ? 4
                        : kShares ? endpoint.qos.depth + 16
                                  : 0),
        callback_(std::move(callback)),
        control_blocks_(endpoint.qos.depth + 16) {}
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
      call(share(block), info);
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
      return pass(share(block), info);
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

  std::shared_ptr<const T> share(MessageBlock& block) {
    if (const std::shared_ptr<const void>* shared = block.shared()) {
      const Hold hold{block};
      return std::static_pointer_cast<const T>(*shared);
    }
    return std::shared_ptr<const T>(
        static_cast<const T*>(block.payload()), [&block](const T*) { block.release(); },
        control_blocks_.template allocator<T>());
  }

  std::unique_ptr<T> own(MessageBlock& block) {
    const Hold hold{block};
    if (void* message = block.steal()) return std::unique_ptr<T>(static_cast<T*>(message));
    return std::make_unique<T>(*static_cast<const T*>(block.payload()));
  }

  F callback_;
  struct NoControlBlocks {
    explicit NoControlBlocks(std::size_t) noexcept {}
  };
  [[no_unique_address]] std::conditional_t<kShares, detail::ControlBlocks, NoControlBlocks>
      control_blocks_;
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

/// What a subscription with this callback is.
template <Message T, SubscriptionCallback<T> F>
using SubscriptionWith = std::conditional_t<CallbackSubscription<T, F>::kIsTask,
                                            TaskSubscription<T, F>, CallbackSubscription<T, F>>;

}  // namespace takt

#endif  // TAKT_ENTITIES_SUBSCRIPTION_HPP_
