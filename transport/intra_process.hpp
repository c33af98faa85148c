// Delivery by pointer inside the process: writers, readers, and who is matched with whom.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_INTRA_PROCESS_HPP_
#define TAKT_TRANSPORT_INTRA_PROCESS_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/keep_last_ring.hpp"
#include "takt/transport/message_block.hpp"
#include "takt/transport/message_type.hpp"
#include "takt/transport/qos.hpp"

namespace takt {

/// One end of a topic: what is matched.
struct Endpoint {
  std::string topic;
  const MessageType* type;
  QoS qos;
};

/// The receiving end: a ring that keeps the newest messages.
/// Thread safety: writers deliver from any thread; take from any thread.
/// Real-time: deliver and take are lock-free and allocate nothing.
class IntraProcessReader {
 public:
  explicit IntraProcessReader(Endpoint endpoint);
  /// Releases what was not taken. Leave the topic first.
  virtual ~IntraProcessReader();

  const Endpoint& endpoint() const noexcept { return endpoint_; }
  /// Joins the topic: from here on messages arrive. Throws Error when the topic has another type.
  void join();
  /// When it returns, no message is being delivered any more. Joining again is possible.
  void leave() noexcept;

  /// `arrival` tells what the envelope tells: the message may be gone once it is in the ring.
  void deliver(MessageBlock& message, const Arrival& arrival) noexcept {
    MessageBlock* old =
        ring_.push(&message, arrival.sequence, arrival.ready_time.time_since_epoch().count());
    if (old != nullptr) drop(*old);
    on_message(arrival);
  }

  /// The oldest message, which the caller must release; nullptr when there is none.
  /// `more` tells whether more were there.
  MessageBlock* take(bool& more) noexcept {
    return ring_.pop([this](MessageBlock* old) { drop(*old); }, more);
  }

  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
  /// How many messages were sent to it: taken, dropped and waiting ones.
  std::uint64_t expected() const noexcept { return ring_.pushed(); }
  /// Whether someone looks at the publish time; without, publishers spare the clock reading.
  void set_wants_time(bool wants) noexcept { wants_time_.store(wants, std::memory_order_relaxed); }
  bool wants_time() const noexcept { return wants_time_.load(std::memory_order_relaxed); }

 protected:
  /// A message has arrived. Called on the publisher's thread, inside a read section.
  virtual void on_message(const Arrival& arrival) noexcept = 0;
  const KeepLastRing<MessageBlock>& ring() const noexcept { return ring_; }

 private:
  void drop(MessageBlock& message) noexcept {
    dropped_.fetch_add(1, std::memory_order_relaxed);  // a statistic, ordered by nothing
    message.release();
  }

  const Endpoint endpoint_;
  KeepLastRing<MessageBlock> ring_;
  std::atomic<bool> wants_time_{false};
  std::atomic<std::uint64_t> dropped_{0};
  bool joined_ = false;
};

/// The sending end. It holds an immutable table of matched readers; joining and leaving replace
/// the table and wait until no publication uses the old one.
/// Thread safety: write from any thread.
/// Real-time: write is lock-free and allocates nothing; linear in the number of readers.
class IntraProcessWriter {
 public:
  IntraProcessWriter(Endpoint endpoint, Clock& clock);
  ~IntraProcessWriter();
  IntraProcessWriter(const IntraProcessWriter&) = delete;
  IntraProcessWriter& operator=(const IntraProcessWriter&) = delete;

  const Endpoint& endpoint() const noexcept { return endpoint_; }
  /// Sends the message to every matched reader and gives up the caller's hold of it.
  void write(MessageBlock& message) noexcept;
  std::size_t reader_count() const noexcept;

 private:
  friend class Topics;
  using Table = std::vector<IntraProcessReader*>;

  const Endpoint endpoint_;
  Clock& clock_;
  std::atomic<const Table*> table_;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_INTRA_PROCESS_HPP_
