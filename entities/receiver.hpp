// Messages that coroutines wait for.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_RECEIVER_HPP_
#define TAKT_ENTITIES_RECEIVER_HPP_

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "takt/base/visibility.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/entities/task_runner.hpp"

namespace TAKT_PUBLIC takt {

/// A subscription without a callback: `auto message = co_await receiver->receive()` in a coroutine
/// gets the oldest message, or waits for the next one. Of several waiting coroutines, the first one
/// gets it. Messages that no task waits for stay, up to the depth. When the receiver is dropped,
/// the coroutines that wait get none: a TakenMessage that is false.
///
/// Thread safety: every method from any thread.
/// Real-time: as Subscription, and a lock with priority inheritance, held for a few instructions.
template <Message T>
class Receiver : public Subscription<T> {
 public:
  class Next;
  Receiver(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
           const Endpoint& endpoint, const std::shared_ptr<Participant>& participant)
      : Subscription<T>(name, group, endpoint, participant, endpoint.qos.depth),
        awaited_(std::make_shared<Awaited>()) {}

  Next receive() noexcept { return Next(*this); }

  std::size_t ready_count() const noexcept override {
    return awaited_->count.load() != 0 ? Subscription<T>::ready_count() : 0;
  }
  using Subscription<T>::take;
  /// Hands the message over, so that nothing is left to execute.
  bool take(Slot& slot) noexcept override {
    ReleasedMessages released;
    const std::lock_guard lock(awaited_->mutex);
    if (awaited_->waiting.empty()) return false;
    slot.message = this->take_message(slot.more, released);
    if (slot.message == nullptr) return false;
    static_cast<Envelope&>(slot) = slot.message->envelope;
    awaited_->resume_first(slot.message);
    slot.more = slot.more && !awaited_->waiting.empty();
    return true;
  }
  void execute(Slot&) override {}
  void discard(Slot&) noexcept override {}
  void retire() noexcept override {
    Subscription<T>::retire();
    const std::lock_guard lock(awaited_->mutex);
    awaited_->is_over = true;
    while (!awaited_->waiting.empty()) awaited_->resume_first(nullptr);
  }

 private:
  // Lives as long as a task waits.
  struct Awaited {
    RankedMutex<LockRank::awaited_message> mutex;
    WaitingList waiting;
    bool is_over = false;  // no more messages come
    std::atomic<std::size_t> count{0};

    void resume_first(MessageBlock* message) noexcept {
      count.fetch_sub(1);
      auto& next = static_cast<typename Next::Waits&>(*waiting.pop());
      next.message = message;
      next.runner->resume_later(next);
    }
  };
  const std::shared_ptr<Awaited> awaited_;
};

template <Message T>
class Receiver<T>::Next {
 public:
  explicit Next(Receiver& receiver) noexcept : receiver_(receiver) {}
  ~Next() {
    if (waits_.runner != nullptr) {
      const std::lock_guard lock(awaited_->mutex);
      if (awaited_->waiting.remove(waits_)) awaited_->count.fetch_sub(1);
      waits_.runner->forget(waits_);
    }
    if (waits_.message != nullptr) waits_.message->release();
  }
  Next(const Next&) = delete;
  Next& operator=(const Next&) = delete;

  bool await_ready() const noexcept { return false; }
  template <class Promise>
  bool await_suspend(std::coroutine_handle<Promise> coroutine) noexcept {
    awaited_ = receiver_.awaited_;
    const std::shared_ptr<Awaited> awaited = awaited_;  // `this` may be gone after the lock
    ReleasedMessages released;
    const std::lock_guard lock(awaited->mutex);
    bool more;
    if (awaited->waiting.empty() &&
        (waits_.message = receiver_.take_message(more, released)) != nullptr) {
      return false;
    }
    if (awaited->is_over) return false;
    waits_.suspend(coroutine);
    awaited->waiting.push(waits_);
    awaited->count.fetch_add(1);
    receiver_.announce_if_ready();  // what came before that was not to be taken
    return true;
  }
  TakenMessage<T> await_resume() noexcept {
    MessageBlock* block = std::exchange(waits_.message, nullptr);
    if (block == nullptr) return {};
    return {block, static_cast<const T*>(block->payload())};
  }

 private:
  friend class Receiver;
  struct Waits : Waiting {
    MessageBlock* message = nullptr;
  };
  Receiver& receiver_;
  std::shared_ptr<Awaited> awaited_;
  Waits waits_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_RECEIVER_HPP_
