// A published message in transit: the payload, the count of its holders, and its envelope.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_MESSAGE_BLOCK_HPP_
#define TAKT_TRANSPORT_MESSAGE_BLOCK_HPP_

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "takt/base/clock.hpp"
#include "takt/base/lockfree/pool.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// When something became ready: in order of arrival and, where a receiver needs it, in time.
struct Arrival {
  std::uint64_t sequence;
  TimePoint ready_time;
  TimePoint root_time{};  // when its chain's first callback became ready; {}: it is that itself
};

/// Is notified of arrivals: an executor, or a wait set.
/// Thread safety: announce from any thread, inside a read section.
/// Real-time: nothing blocks or allocates.
class ArrivalListener {
 public:
  /// Something has arrived.
  virtual void announce(const Arrival& arrival) noexcept = 0;
  /// Whether what has arrived is taken on the calling thread, and on no other.
  virtual bool takes_here() const noexcept { return false; }

 protected:
  ~ArrivalListener() = default;
};

/// What travels with a message. `publish` fills it from the callback that it is called in, so
/// chains, latencies and later logical execution time and tracing all live on this one hook.
struct Envelope {
  std::uint64_t sequence = 0;        // order of publication, over the process
  TimePoint ready_time{};            // when it was published; only when a receiver wants time
  TimePoint root_release{};          // when the first callback of the chain became ready
  std::uint64_t chain_instance = 0;  // sequence of the first release of the chain; 0 outside chains
  std::uint64_t path = 0;            // through which callbacks it has come, see extend_path
  Nanoseconds expected_period{0};    // the publisher's, 0 unknown: what counts as late
};

/// The time that messages to other processes carry.
using WallTime = std::chrono::system_clock::time_point;

/// Where a message of another process comes from; for one of this process it stays as it is.
struct Origin {
  WallTime source_time{};    // when it was published, by its own clock
  std::uint64_t writer = 0;  // a number of the publisher
};

/// The payload with a count of the holders that have not released it.
/// Thread safety: release from any thread; the rest belongs to the publisher before it is sent,
/// and is read-only afterwards.
/// Real-time: release neither blocks nor allocates; the last one gives the payload back to its
/// pool, or to the heap if the user's message came from there.
/// Aligned: two messages in different threads' hands share no cache line.
class alignas(64) MessageBlock {
 public:
  Envelope envelope;
  Origin origin;

  /// nullptr: it has come as bytes that are not decoded yet, see `encoded`.
  const void* payload() const noexcept { return payload_; }
  /// CDR with its header, where there is no payload.
  virtual std::span<const std::byte> encoded() const noexcept { return {}; }

  /// The first field, for messages that are for one reader each; nothing: it is no uint64 in CDR.
  std::optional<std::uint64_t> address() const noexcept;

  void set_references(std::uint32_t count) noexcept {
    references_.store(count, std::memory_order_relaxed);  // published by the ring's swap
  }
  /// It is not delivered later than that. Called each time it is sent, if there is a lifespan.
  void expire_at(TimePoint expiry, const Clock& clock) noexcept {
    expiry_ = expiry;
    expiry_clock_ = &clock;
  }
  /// As another one, of which it is a copy.
  void expire_as(const MessageBlock& other) noexcept {
    expiry_ = other.expiry_;
    expiry_clock_ = other.expiry_clock_;
  }
  bool can_expire() const noexcept { return expiry_clock_ != nullptr; }
  bool is_expired() const noexcept { return can_expire() && expiry_clock_->now() > expiry_; }

  /// One more hold, for a caller that has one.
  void retain() noexcept { references_.fetch_add(1, std::memory_order_relaxed); }
  void release() noexcept {
    if (is_last_release()) recycle();
  }
  /// As release, but the caller gives an object that nobody holds to ReleasedMessages.
  [[nodiscard]] bool is_last_release() noexcept {
    // Acquire and release: pair with each other; all uses end before the payload goes.
    return references_.load(std::memory_order_acquire) == 1 ||
           references_.fetch_sub(1, std::memory_order_acq_rel) == 1;
  }
  /// The payload for a receiver that wants to own it: moved out when no other holds it and it
  /// came from the heap, else nullptr (the receiver copies).
  void* steal() noexcept {
    return references_.load(std::memory_order_acquire) == 1 ? give_away() : nullptr;
  }
  /// Whether the caller is its only holder, and may change it or move from it.
  bool may_change() const noexcept {
    return references_.load(std::memory_order_acquire) == 1 && is_nobody_elses();
  }
  /// The payload as the publisher's shared_ptr, if it was published as one.
  virtual const std::shared_ptr<const void>* shared() const noexcept { return nullptr; }

 protected:
  MessageBlock() = default;
  ~MessageBlock() = default;
  virtual void recycle() noexcept = 0;
  virtual void* give_away() noexcept { return nullptr; }
  /// Whether no code but its receivers' relies on its content.
  virtual bool is_nobody_elses() const noexcept { return false; }

  const void* payload_ = nullptr;

 private:
  friend class ReleasedMessages;

  std::atomic<std::uint32_t> references_{0};
  const Clock* expiry_clock_ = nullptr;  // nullptr: it is delivered however old
  TimePoint expiry_{};
  MessageBlock* next_released_ = nullptr;
};

/// Messages that are released under a lock, or in a read section, and go when this object does: a
/// user's message may own what takes that lock, or waits for the section. Declare it before.
/// Thread safety: belongs to one thread.
/// Real-time: as MessageBlock::release.
class ReleasedMessages {
 public:
  ReleasedMessages() = default;
  ~ReleasedMessages() {
    if (first_ != nullptr) [[unlikely]]
      recycle(first_);
  }
  ReleasedMessages(const ReleasedMessages&) = delete;
  ReleasedMessages& operator=(const ReleasedMessages&) = delete;

  void release(MessageBlock& message) noexcept {
    if (message.is_last_release()) add(message);
  }
  /// One that nobody holds any more.
  void add(MessageBlock& message) noexcept {
    message.next_released_ = std::exchange(first_, &message);
  }

 private:
  // Not a member, which would keep the object out of registers where messages are sent.
  [[gnu::noinline]] static void recycle(MessageBlock* first) noexcept;

  MessageBlock* first_ = nullptr;
};

/// Gives back a hold of a message.
struct ReleaseMessage {
  void operator()(MessageBlock* block) const noexcept { block->release(); }
};
using HeldMessage = std::unique_ptr<MessageBlock, ReleaseMessage>;

/// A message that lives in its publisher's pool. It is constructed once and keeps its memory
/// (a vector's capacity, say) from one loan to the next.
/// Thread safety and real-time: as MessageBlock.
class LoanedBlock : public MessageBlock, public PoolNode<LoanedBlock> {
 public:
  virtual ~LoanedBlock() = default;
  // The loan is not const, but receivers must not write to the message.
  void* message() noexcept { return const_cast<void*>(payload_); }
  /// Each time it is lent, all of it is written. Otherwise it keeps what its publisher wrote
  /// before.
  bool is_filled_anew = false;

 private:
  void recycle() noexcept override;
  bool is_nobody_elses() const noexcept override { return is_filled_anew; }
};

/// The loan with its message, which is all that depends on the type.
/// Thread safety and real-time: as LoanedBlock.
template <class T>
class LoanOf final : public LoanedBlock {
 public:
  LoanOf() : value_() { payload_ = &value_; }
  explicit LoanOf(const T& prototype) : value_(prototype) { payload_ = &value_; }

 private:
  T value_;
};

/// A message that the user made: by unique_ptr (moves) or shared_ptr<const T> (fans out).
/// Thread safety: as MessageBlock.
/// Real-time: as MessageBlock; the last release frees the user's message.
class OwnedBlock final : public MessageBlock, public PoolNode<OwnedBlock> {
 public:
  OwnedBlock() = default;
  ~OwnedBlock() { free_owned(); }

  template <class T>
  void own(std::unique_ptr<T> message) noexcept {
    payload_ = owned_ = message.release();
    free_ = [](void* owned) noexcept { delete static_cast<T*>(owned); };
  }
  void own(std::shared_ptr<const void> message) noexcept {
    payload_ = message.get();
    shared_ = std::move(message);
  }
  const std::shared_ptr<const void>* shared() const noexcept override {
    return shared_ ? &shared_ : nullptr;
  }
  bool from_heap = false;  // made because the pool was empty

 private:
  void recycle() noexcept override;
  void* give_away() noexcept override { return std::exchange(owned_, nullptr); }
  bool is_nobody_elses() const noexcept override { return owned_ != nullptr; }
  void free_owned() noexcept {
    if (owned_ != nullptr) free_(std::exchange(owned_, nullptr));
  }

  void* owned_ = nullptr;  // came by unique_ptr
  void (*free_)(void*) noexcept = nullptr;
  std::shared_ptr<const void> shared_;
};

/// Makes messages of a type for those that do not know it.
/// Thread safety: immutable.
struct MessageMaker {
  Pool<LoanedBlock>::Layout layout;                          // of a loan
  LoanedBlock* (*loan)(void* place, const void* prototype);  // nullptr: with a T{}
  void* (*own)(OwnedBlock& block);                           // a new T{}, which it returns
};
template <class T>
inline constexpr MessageMaker kMakerOf = {{sizeof(LoanOf<T>), alignof(LoanOf<T>)},
                                          [](void* place, const void* prototype) -> LoanedBlock* {
                                            if (prototype == nullptr) return new (place) LoanOf<T>;
                                            return new (place)
                                                LoanOf<T>(*static_cast<const T*>(prototype));
                                          },
                                          [](OwnedBlock& block) -> void* {
                                            auto message = std::make_unique<T>();
                                            T* const address = message.get();
                                            block.own(std::move(message));
                                            return address;
                                          }};

/// How many of these the memory is set aside for: no more than a mebibyte, or four.
constexpr std::size_t most_in_advance(std::size_t wanted, std::size_t bytes_each) noexcept {
  return std::min(wanted, std::max<std::size_t>((std::size_t{1} << 20) / bytes_each, 4));
}

/// So many loans, each as `prototype`, all made at once.
PoolPtr<LoanedBlock> make_loans(std::size_t count, const MessageMaker& maker,
                                const void* prototype = nullptr);
/// One of no pool.
std::unique_ptr<LoanedBlock> make_loan(const MessageMaker& maker, const void* prototype);
/// So many of T{}, as they are needed, for those that write all of a message.
PoolPtr<LoanedBlock> make_loans_by_need(std::size_t count, const MessageMaker& maker);

}  // namespace takt

#endif  // TAKT_TRANSPORT_MESSAGE_BLOCK_HPP_
