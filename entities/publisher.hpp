// Sends messages of one type to one topic.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_PUBLISHER_HPP_
#define TAKT_ENTITIES_PUBLISHER_HPP_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/tracepoints.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/entities/send.hpp"
#include "takt/entities/staged_outputs.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

template <Message T>
class Publisher;

/// A message in its publisher's pool, or in shared memory, until it is published. If it is never
/// published, it goes back. False when the pool was empty.
/// Thread safety: as any value.
/// Real-time: nothing blocks or allocates.
template <Message T>
class LoanedMessage {
 public:
  LoanedMessage() = default;
  LoanedMessage(LoanedMessage&& other) noexcept
      : block_(std::exchange(other.block_, nullptr)), is_outside_(other.is_outside_) {}
  LoanedMessage& operator=(LoanedMessage&& other) noexcept {
    std::swap(block_, other.block_);
    std::swap(is_outside_, other.is_outside_);
    return *this;
  }
  ~LoanedMessage() {
    if (block_ == nullptr) return;
    block_->set_references(1);
    block_->release();
  }

  explicit operator bool() const noexcept { return block_ != nullptr; }
  T& operator*() const noexcept { return *operator->(); }
  // The loan is not const, but receivers must not write to the message.
  T* operator->() const noexcept { return static_cast<T*>(const_cast<void*>(block_->payload())); }

 private:
  friend class Publisher<T>;
  LoanedMessage(MessageBlock* block, bool is_outside) noexcept
      : block_(block), is_outside_(is_outside) {}
  MessageBlock* block_ = nullptr;
  bool is_outside_ = false;  // of the process: in shared memory
};

/// How a publisher behaves beyond its QoS.
template <Message T>
struct PublisherOptions {
  /// How many messages can be on loan or in transit at once. The publisher allocates them in
  /// advance.
  std::size_t loans = 0;
  /// The initial content of each loan: give vectors and strings their final capacity here, and
  /// nothing allocates afterwards. A loan keeps what its last user wrote. nullptr: a T{}.
  std::shared_ptr<const T> prototype = nullptr;
  /// Its publishing period, if known: receivers then report late messages.
  Nanoseconds expected_period{0};
  /// The names of the node's callbacks that publish with it, to find chains. Empty: any of them
  /// may.
  std::vector<std::string> published_by;
  /// Those callbacks together publish one message when each of them has run since the last one, as
  /// a ChainJoin combines them. Otherwise each may publish whenever it runs.
  bool joins = false;
  /// The full name of the node that has the publisher in ROS 2's graph; empty: the node that makes
  /// it.
  std::string graph_node;
};

/// The part of a publisher that does not depend on the type of its messages.
/// Thread safety: every method from any thread.
/// Real-time: nothing blocks or allocates, see Publisher.
class PublisherBase {
 public:
  PublisherBase(const PublisherBase&) = delete;
  PublisherBase& operator=(const PublisherBase&) = delete;

  const std::string& topic() const noexcept { return writer_.endpoint().topic; }
  const QoS& qos() const noexcept { return writer_.endpoint().qos; }
  const std::shared_ptr<EndpointEvents>& events() const noexcept { return writer_.events(); }
  /// Where liveliness is manual: it is alive, though it publishes nothing.
  void assert_liveliness() noexcept {
    writer_.assert_liveliness();
    if (remote_ != nullptr) remote_->assert_liveliness();
  }
  /// Waits until every reliable subscription in another process has confirmed what was published;
  /// one in this process has it at once. False: it took longer. Not for callbacks that must not
  /// block.
  bool wait_for_all_acked(Nanoseconds timeout = Nanoseconds::max()) noexcept {
    return remote_ == nullptr || remote_->wait_for_acks(timeout);
  }
  /// Whether it was made with loans.
  bool has_loans() const noexcept { return has_loans_; }
  /// How often it had none to lend, as all were with receivers.
  std::uint64_t refused_loans() const noexcept { return writer_.refused_loans(); }
  /// In this process and in others.
  std::size_t subscription_count() const noexcept {
    return local_subscription_count() + outside_subscription_count();
  }
  std::size_t outside_subscription_count() const noexcept {
    return remote_ != nullptr ? remote_->reader_count() : 0;
  }
  /// In this process.
  std::size_t local_subscription_count() const noexcept { return writer_.reader_count(); }
  /// For its node, whose handle that is: it was made.
  void trace_made(const void* node) const;

 protected:
  /// `loans` and `prototype` as in PublisherOptions.
  PublisherBase(const Endpoint& endpoint, Clock& clock, Nanoseconds expected_period,
                const std::shared_ptr<Participant>& participant, const MessageMaker& maker,
                std::size_t loans, const void* prototype);
  ~PublisherBase();

  /// nullptr: all are out.
  LoanedBlock* lend() noexcept { return loans_->acquire(); }
  [[gnu::cold]] void count_refused_loan() noexcept { writer_.refuse_loan(); }
  /// No reader in this process is matched, and the message is not to be held back.
  bool is_for_outside_only() const noexcept;
  /// nullptr: shared memory lends nothing.
  MessageBlock* lend_outside() noexcept {
    return prototype_ != nullptr && is_for_outside_only() ? remote_->lend(prototype_->payload())
                                                          : nullptr;
  }
  /// Of what is published now; it is known then when that is for others.
  [[gnu::cold, gnu::noinline]] void trace(const Tracepoints& points, const void* message,
                                          PublishTime& published) const noexcept;
  PublishTime stamp() const noexcept {
    return {writer_.stamp(), remote_ != nullptr ? remote_->stamp() : WallTime{}};
  }
  void write_lent(MessageBlock& block, PublishTime published) noexcept {
    const Tracepoints* const points = tracepoints();
    if (points != nullptr && points->records_messages()) [[unlikely]]
      trace(*points, block.payload(), published);
    remote_->write_lent(block, published.far);
  }
  void send(MessageBlock& block, PublishTime published) noexcept {
    const Tracepoints* const points = tracepoints();
    if (points != nullptr && points->records_messages()) [[unlikely]]
      trace(*points, block.payload(), published);
    const Dispatch* dispatch = Dispatch::current();
    block.envelope.chain_instance = dispatch != nullptr ? dispatch->chain_instance : 0;
    block.envelope.root_release = dispatch != nullptr ? dispatch->root_release : TimePoint{};
    block.envelope.path = dispatch != nullptr ? dispatch->path : 0;
    block.envelope.expected_period = expected_period_;
    if (dispatch != nullptr && dispatch->outputs != nullptr) [[unlikely]] {
      return dispatch->outputs->add(writer_, remote_.get(), block);
    }
    takt::send(writer_, remote_.get(), block, published);
  }
  /// For a message that the user made.
  OwnedBlock& wrapper();
  [[noreturn, gnu::cold]] void refuse_null() const;
  [[noreturn, gnu::cold]] void refuse_loan() const;

 private:
  IntraProcessWriter writer_;
  const std::unique_ptr<RemoteWriter> remote_;
  const Nanoseconds expected_period_;
  const PoolPtr<OwnedBlock> wrappers_;
  const bool has_loans_;
  const PoolPtr<LoanedBlock> loans_;              // or what copies are made in
  const std::unique_ptr<LoanedBlock> prototype_;  // of loans to others; nullptr: there are none
};

/// Thread safety: every method from any thread.
/// Real-time: a loaned message is published without lock, allocation or copy. publish(unique_ptr)
/// and publish(shared_ptr) add no allocation to the user's own while fewer than depth + 16 such
/// messages are in transit. publish(const T&) copies: into a loan, or, where it was made without
/// loans, into what a copy before it has left, with the memory of its strings and vectors; into
/// the heap when all are in transit, which are depth + 16 or a mebibyte of them. With
/// receivers in other processes it also encodes the message, or copies it into shared memory, and
/// makes Cyclone DDS send it, see Participant. Only loans in shared memory are neither
/// encoded nor copied.
template <Message T>
class Publisher : public PublisherBase {
 public:
  using SharedPtr = std::shared_ptr<Publisher>;

  /// `participant`: sends to other processes too; may be nullptr.
  Publisher(const Endpoint& endpoint, Clock& clock, const PublisherOptions<T>& options = {},
            const std::shared_ptr<Participant>& participant = nullptr)
      : PublisherBase(endpoint, clock, options.expected_period, participant, kMakerOf<T>,
                      options.loans, options.prototype.get()) {}

  /// Lent by shared memory when all receivers are in other processes and the topic goes there by
  /// it, up to seven at once. Receivers in this process read a message by its pointer, so if there
  /// are any it is lent from the pool, and copied for the others. An empty loan, which is counted,
  /// when all of the pool are out: the publisher is faster than its receivers (back-pressure).
  /// Throws Error when the publisher was made without loans.
  LoanedMessage<T> borrow_loaned_message() {
    if (!has_loans()) refuse_loan();
    if (MessageBlock* block = lend_outside()) return {block, true};
    LoanedBlock* const block = lend();
    if (block == nullptr) [[unlikely]]
      this->count_refused_loan();
    return {block, false};
  }

  /// What publish(const T&) copies into, to be written whole: it has the content of a message
  /// before. The publisher may have no loans. Empty when all are in transit.
  LoanedMessage<T> place_for_copy() noexcept { return {lend(), false}; }

  void publish(LoanedMessage<T>&& message) noexcept {
    const PublishTime now = stamp();
    if (!message) return;
    if (message.is_outside_) [[unlikely]]
      return publish_lent(std::move(message), now);
    send(*std::exchange(message.block_, nullptr), now);
  }
  void publish(std::unique_ptr<T> message) { publish_owned(std::move(message), stamp()); }
  void publish(std::shared_ptr<const T> message) { publish_owned(std::move(message), stamp()); }
  void publish(const T& message) { publish_copy(message, stamp()); }

 private:
  // Apart, so that publish() is short enough to be inlined.
  [[gnu::noinline]] void publish_lent(LoanedMessage<T>&& message, const PublishTime& now) noexcept {
    if (is_for_outside_only()) return write_lent(*std::exchange(message.block_, nullptr), now);
    const LoanedMessage<T> loan = std::move(message);
    publish_copy(*loan, now);  // a reader in this process has come meanwhile
  }
  void publish_copy(const T& message, const PublishTime& now) {
    if (LoanedMessage<T> loan = place_for_copy()) {
      *loan = message;
      send(*std::exchange(loan.block_, nullptr), now);
    } else {
      publish_owned(std::make_unique<T>(message), now);
    }
  }
  template <class Pointer>
  void publish_owned(Pointer message, const PublishTime& now) {
    if (message == nullptr) refuse_null();
    OwnedBlock& block = wrapper();
    block.own(std::move(message));
    send(block, now);
  }
};

}  // namespace takt

#endif  // TAKT_ENTITIES_PUBLISHER_HPP_
