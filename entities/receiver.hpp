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
/// gets it. Messages that no task waits for stay, up to the depth.
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
    const std::lock_guard lock(awaited_->mutex);
    if (awaited_->waiting.empty() || !Subscription<T>::take(slot)) return false;
    auto& next = static_cast<typename Next::Waits&>(*awaited_->pop());
    next.message = slot.message;
    next.runner->resume_later(next);
    slot.more = slot.more && !awaited_->waiting.empty();
    return true;
  }
  void execute(Slot&) override {}
  void discard(Slot&) noexcept override {}

 private:
  // Lives as long as a task waits.
  struct Awaited {
    PiMutex mutex;
    WaitingList waiting;
    std::atomic<std::size_t> count{0};

    Waiting* pop() noexcept {
      count.fetch_sub(1);
      return waiting.pop();
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
    const std::lock_guard lock(awaited->mutex);
    bool more;
    if (awaited->waiting.empty() && (waits_.message = receiver_.take_message(more)) != nullptr) {
      return false;
    }
    waits_.suspend(coroutine);
    awaited->waiting.push(waits_);
    awaited->count.fetch_add(1);
    receiver_.announce_if_ready();  // what came before that was not to be taken
    return true;
  }
  TakenMessage<T> await_resume() noexcept {
    MessageBlock* block = std::exchange(waits_.message, nullptr);
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
