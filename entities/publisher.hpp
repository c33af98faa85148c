// Sends messages of one type to one topic.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_PUBLISHER_HPP_
#define TAKT_ENTITIES_PUBLISHER_HPP_

#include <memory>
#include <string>
#include <utility>

#include "takt/entities/entity.hpp"
#include "takt/transport/intra_process.hpp"

namespace takt {

template <Message T>
class Publisher;

/// A message that lies in its publisher's pool until it is published; if it never is, it goes
/// back. False when the pool was empty.
/// Thread safety: as any value.
/// Real-time: nothing blocks or allocates.
template <Message T>
class LoanedMessage {
 public:
  LoanedMessage() = default;
  LoanedMessage(LoanedMessage&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  LoanedMessage& operator=(LoanedMessage&& other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }
  ~LoanedMessage() {
    if (block_ != nullptr) Pool<LoanedBlock<T>>::recycle(*block_);
  }

  explicit operator bool() const noexcept { return block_ != nullptr; }
  T& operator*() const noexcept { return block_->message; }
  T* operator->() const noexcept { return &block_->message; }

 private:
  friend class Publisher<T>;
  explicit LoanedMessage(LoanedBlock<T>* block) noexcept : block_(block) {}
  LoanedBlock<T>* block_ = nullptr;
};

/// How a publisher behaves beyond its QoS.
template <Message T>
struct PublisherOptions {
  /// How many messages can be on loan or on their way at once. They are made with the publisher.
  std::size_t loans = 0;
  /// What a fresh loan looks like: give vectors and strings their final capacity here, and
  /// nothing allocates afterwards. A loan keeps what its last user wrote.
  T prototype{};
  /// How often it publishes, if that is known: a receiver's report then tells what was late.
  Nanoseconds expected_period{0};
};

/// Thread safety: every method from any thread.
/// Real-time: a loaned message is published without lock, allocation or copy. publish(unique_ptr)
/// and publish(shared_ptr) add no allocation to the user's own while fewer than depth + 16 such
/// messages are on their way. publish(const T&) copies: into a loan, or else to the heap.
template <Message T>
class Publisher {
 public:
  Publisher(std::string topic, const QoS& qos, Clock& clock, PublisherOptions<T> options = {})
      : writer_({std::move(topic), &message_type<T>(), qos}, clock),
        expected_period_(options.expected_period),
        loans_(Pool<LoanedBlock<T>>::create(
            options.loans,
            [&](std::uint32_t) { return std::make_unique<LoanedBlock<T>>(options.prototype); })),
        wrappers_(Pool<OwnedBlock<T>>::create(
            qos.depth + 16, [](std::uint32_t) { return std::make_unique<OwnedBlock<T>>(); })) {}

  const std::string& topic() const noexcept { return writer_.endpoint().topic; }
  std::size_t subscription_count() const noexcept { return writer_.reader_count(); }

  /// An empty loan when all are out: the publisher is faster than its receivers (back-pressure).
  /// Throws Error when the publisher was made without loans.
  LoanedMessage<T> borrow_loaned_message() {
    if (loans_->capacity() == 0) {
      throw Error("publisher of '" + topic() + "' has no messages to lend",
                  "give PublisherOptions::loans when you create it");
    }
    return LoanedMessage<T>(loans_->acquire());
  }

  void publish(LoanedMessage<T>&& message) noexcept {
    if (message) send(*std::exchange(message.block_, nullptr));
  }
  void publish(std::unique_ptr<T> message) { wrap(std::move(message)); }
  void publish(std::shared_ptr<const T> message) { wrap(std::move(message)); }
  void publish(const T& message) {
    if (LoanedMessage<T> loan{loans_->acquire()}) {
      *loan = message;
      publish(std::move(loan));
    } else {
      publish(std::make_unique<T>(message));
    }
  }

 private:
  template <class Pointer>
  void wrap(Pointer message) {
    if (message == nullptr) throw Error("a null message was published on '" + topic() + "'");
    OwnedBlock<T>* block = wrappers_->acquire();
    if (block == nullptr) {
      block = new OwnedBlock<T>;
      block->from_heap = true;
    }
    block->own(std::move(message));
    send(*block);
  }

  void send(MessageBlock& block) noexcept {
    const Dispatch* dispatch = Dispatch::current();
    block.envelope.chain_instance = dispatch != nullptr ? dispatch->chain_instance : 0;
    block.envelope.root_release = dispatch != nullptr ? dispatch->root_release : TimePoint{};
    block.envelope.expected_period = expected_period_;
    writer_.write(block);
  }

  IntraProcessWriter writer_;
  const Nanoseconds expected_period_;
  const PoolPtr<LoanedBlock<T>> loans_;
  const PoolPtr<OwnedBlock<T>> wrappers_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_PUBLISHER_HPP_
