// Delivery by pointer inside the process: writers, readers, and their matches.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_INTRA_PROCESS_HPP_
#define TAKT_TRANSPORT_INTRA_PROCESS_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/lockfree/keep_last_ring.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/tracepoints.hpp"
#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"
#include "takt/transport/endpoint_events.hpp"
#include "takt/transport/message_block.hpp"
#include "takt/transport/qos.hpp"

namespace TAKT_PUBLIC takt {

/// What both ends of a service, or of a client, publish about it.
struct ServiceIdentity {
  std::string id;                        // "serviceid=1.2f...;" or "clientid=...;"; empty: a topic
  const MessageType* request = nullptr;  // without the header
  const MessageType* response = nullptr;

  /// The one of both types that a topic with this type of message carries.
  const MessageType& part(const std::string& name) const {
    return name == request->name ? *request : *response;
  }
};

/// An endpoint of a topic. Name, type and QoS decide about matches; the rest is what ROS 2's graph
/// shows.
struct Endpoint {
  std::string topic;
  const MessageType* type;
  QoS qos;
  std::string node;  // its full name; empty: none
  ServiceIdentity identity;
};

class IntraProcessReader;

/// What stands between a topic and one of its readers in a simulation: it may lose messages, keep
/// them for a while, and repeat them.
/// Thread safety: called by each writer of the topic; under a manual clock one at a time.
/// Real-time: no.
class DeliveryFilter {
 public:
  /// Instead of `reader.deliver_now`. It has the reader's hold of the message, and what it calls in
  /// a read section it calls in one.
  virtual void deliver(IntraProcessReader& reader, MessageBlock& message, const Arrival& arrival,
                       ReleasedMessages& released) noexcept = 0;

 protected:
  ~DeliveryFilter() = default;
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

  /// `arrival` repeats the envelope: the message may be gone once it is in the ring. In a read
  /// section, which `released` outlives.
  [[gnu::always_inline]] void deliver(MessageBlock& message, const Arrival& arrival,
                                      ReleasedMessages& released) noexcept {
    if (selects_) [[unlikely]]
      return select(message, arrival, released);
    deliver_now(message, arrival, released);
  }
  /// The same, whatever is selected.
  [[gnu::always_inline]] void deliver_now(MessageBlock& message, const Arrival& arrival,
                                          ReleasedMessages& released) noexcept {
    ArrivalListener* listener = listener_.load();
    const std::int64_t time_ns = arrival.ready_time.time_since_epoch().count();
    const std::int64_t root_time_ns = arrival.root_time.time_since_epoch().count();
    MessageBlock* old = listener != nullptr && listener->takes_here()
                            ? ring_.push_here(&message, arrival.sequence, time_ns, root_time_ns)
                            : ring_.push(&message, arrival.sequence, time_ns, root_time_ns);
    if (old != nullptr && drop(*old)) released.add(*old);
    if (has_deadline_) [[unlikely]]
      events_->set_last_message(arrival.ready_time);
    listener = listener_.load();  // after the push: a new listener looks for messages itself
    if (listener != nullptr) listener->announce(arrival);
  }

  /// Sets the listener that is notified of messages, on the publisher's thread; nullptr: none. The
  /// previous one may still be notified until wait_for_readers() has returned.
  void set_listener(ArrivalListener* listener) noexcept { listener_.store(listener); }

  /// From here on only messages arrive whose first field, a uint64, is this number: so one topic
  /// can carry what is for one reader each. Before join.
  void set_address(std::uint64_t address) noexcept {
    address_ = address;
    selects_ = true;
  }
  /// For a simulation, before anything is sent. It outlives all writers' use of the reader.
  void set_filter(DeliveryFilter& filter) noexcept {
    filter_ = &filter;
    selects_ = true;
  }

  /// The oldest message, which the caller must release; nullptr when there is none.
  /// `more`: whether more were there.
  MessageBlock* take(bool& more) noexcept {
    MessageBlock* message = ring_.pop([this](MessageBlock* old) { drop_now(*old); }, more);
    if (message != nullptr && message->can_expire()) [[unlikely]] {
      ReleasedMessages released;
      return skip_expired(message, more, released);
    }
    return message;
  }
  /// For a caller with a lock, which `released` outlives.
  MessageBlock* take(bool& more, ReleasedMessages& released) noexcept;

  /// The number of messages that were sent to it, and of those that were overwritten.
  void miss(std::uint64_t count) noexcept { missed_.fetch_add(count, std::memory_order_relaxed); }

  std::uint64_t dropped() const noexcept {
    return dropped_.load(std::memory_order_relaxed) + missed_.load(std::memory_order_relaxed);
  }
  /// How many messages were sent to it: taken, dropped and waiting ones.
  std::uint64_t expected() const noexcept {
    return ring_.pushed() + missed_.load(std::memory_order_relaxed);
  }
  /// Whether someone looks at the publish time; without, publishers spare the clock reading.
  void set_wants_time(bool wants) noexcept { wants_time_.store(wants, std::memory_order_relaxed); }
  bool wants_time() const noexcept {
    return has_deadline_ || wants_time_.load(std::memory_order_relaxed);
  }
  const std::shared_ptr<EndpointEvents>& events() const noexcept { return events_; }
  /// How many messages wait.
  std::size_t queued() const noexcept { return ring_.size(); }

  /// Of a serialized type: what a payload is, which comes from this process.
  const MessageType* payload_type() const noexcept { return payload_type_.load(); }
  void set_payload_type(const MessageType& type) noexcept { payload_type_.store(&type); }

 protected:
  const KeepLastRing<MessageBlock>& ring() const noexcept { return ring_; }

 private:
  [[gnu::cold, gnu::noinline]] void select(MessageBlock& message, const Arrival& arrival,
                                           ReleasedMessages& released) noexcept;
  MessageBlock* skip_expired(MessageBlock* message, bool& more,
                             ReleasedMessages& released) noexcept;
  [[nodiscard]] bool drop(MessageBlock& message) noexcept;
  void drop_now(MessageBlock& message) noexcept;
  MessageBlock* pop(bool& more, ReleasedMessages& released) noexcept;

  const Endpoint endpoint_;
  KeepLastRing<MessageBlock> ring_;
  std::atomic<ArrivalListener*> listener_{nullptr};
  std::atomic<bool> wants_time_{true};  // until an executor says that it does not
  std::atomic<std::uint64_t> dropped_{0}, missed_{0};
  std::uint64_t address_ = 0;         // 0: every message is for us
  DeliveryFilter* filter_ = nullptr;  // nullptr: each is delivered
  bool selects_ = false;              // there is an address or a filter
  std::atomic<const MessageType*> payload_type_{nullptr};
  const bool has_deadline_;
  bool joined_ = false;
  const std::shared_ptr<EndpointEvents> events_ = std::make_shared<EndpointEvents>();
};

/// The sending end. It holds an immutable table of matched readers; joining and leaving replace
/// the table and wait until no publication uses the old one.
/// Thread safety: write from any thread.
/// Real-time: write is lock-free and allocates nothing; linear in the number of readers. Where the
/// QoS is transient local, it keeps messages for late joiners, under a lock with priority
/// inheritance that is held for a publication, or for handing them over.
class IntraProcessWriter {
 public:
  IntraProcessWriter(Endpoint endpoint, Clock& clock);
  ~IntraProcessWriter();
  IntraProcessWriter(const IntraProcessWriter&) = delete;
  IntraProcessWriter& operator=(const IntraProcessWriter&) = delete;

  const Endpoint& endpoint() const noexcept { return endpoint_; }
  /// The time, for `write`: to be read before anything is done with the message. {} if no reader
  /// has wanted it lately; one that has come since then gets the time of the sending.
  TimePoint stamp() const noexcept {
    return wants_time_.load(std::memory_order_relaxed) ? clock_.now() : TimePoint{};
  }
  /// Sends the message to every matched reader and gives up the caller's hold of it, but for
  /// `kept` of them. `published`: a stamp, or {}.
  void write(MessageBlock& message, TimePoint published = {}, std::uint32_t kept = 0) noexcept;
  /// For a caller with a lock, which `released` outlives.
  void write(MessageBlock& message, TimePoint published, std::uint32_t kept,
             ReleasedMessages& released) noexcept;
  std::size_t reader_count() const noexcept;
  /// That the message is going to be in the ring of each reader.
  [[gnu::cold]] void trace_enqueue(const Tracepoints& points, const void* message) const noexcept;
  /// Its publisher had no message to lend.
  void refuse_loan() noexcept { refused_loans_.fetch_add(1, std::memory_order_relaxed); }
  std::uint64_t refused_loans() const noexcept {
    return refused_loans_.load(std::memory_order_relaxed);
  }
  /// With manual liveliness: it is alive, though it sends nothing.
  void assert_liveliness() noexcept;
  const std::shared_ptr<EndpointEvents>& events() const noexcept { return events_; }

 private:
  friend class Topics;
  using Table = std::vector<IntraProcessReader*>;
  /// The last messages.
  struct History {
    RankedMutex<LockRank::history>
        mutex;  // a publication is in the history and in the table's rings, or in none
    std::vector<MessageBlock*> messages;  // once there are `depth`, a ring
    std::size_t next = 0;                 // where the oldest is, once it is full
  };

  void send(MessageBlock& message, TimePoint published, std::uint32_t kept,
            ReleasedMessages& released) noexcept;
  [[gnu::cold, gnu::noinline]] void send_by_policies(MessageBlock& message, TimePoint published,
                                                     std::uint32_t kept,
                                                     ReleasedMessages& released) noexcept;

  const Endpoint endpoint_;
  Clock& clock_;
  const std::unique_ptr<History> history_;        // nullptr: nothing is kept
  const std::shared_ptr<LivelinessLease> lease_;  // nullptr: it is alive as long as it exists
  const bool has_policies_;                       // for which more is done than to send
  const std::shared_ptr<EndpointEvents> events_ = std::make_shared<EndpointEvents>();
  std::atomic<std::uint64_t> refused_loans_{0};
  std::atomic<const Table*> table_;
  std::atomic<bool> wants_time_{true};  // a reader, when the last message was sent
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_INTRA_PROCESS_HPP_
