// The calls of a client that wait for their answers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_PENDING_CALLS_HPP_
#define TAKT_ENTITIES_PENDING_CALLS_HPP_

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/task_runner.hpp"

namespace TAKT_PUBLIC takt {

struct ClientOptions {
  /// Limit of outstanding calls; one more throws an Error.
  std::size_t calls_in_flight = 100;
  /// The timeout of a call, after which it ends without an answer. 0: none.
  Nanoseconds timeout{0};
  /// A call that no service can answer, as there was none, or as it has gone, ends without an
  /// answer so long after that was known. Nanoseconds::max(): it waits on, as in ROS 2.
  Nanoseconds without_service = std::chrono::seconds(2);
  /// Calls in flight are sent again when a service has come or gone: for requests that a service
  /// may get twice. So a service that is restarted in time answers them.
  bool repeats = false;
};

namespace detail {

/// A coroutine that waits for an answer. It goes on when its call has been sent and is over: while
/// it is being sent, both the request in the coroutine's frame and the client, which the coroutine
/// may drop, are needed.
struct AwaitedAnswer : Waiting {
  MessageBlock* response = nullptr;  // none: no answer came in time
  std::int64_t sequence = 0;         // of its call
  bool is_sent = false, is_over = false;

  // With the lock held under which it waits.
  void answer(MessageBlock* block) noexcept {
    if (block != nullptr) block->retain();
    response = block;
    is_over = true;
    if (is_sent) runner->resume_later(*this);
  }
  void sent() noexcept {
    is_sent = true;
    if (is_over) runner->resume_later(*this);
  }
};

/// The calls that wait for an answer, with what is to be done then. A call's number says at which
/// place it is. All calls have the same timeout, and lose their service at the same time: so their
/// order is also that of their deadlines.
/// Thread safety: from any thread.
/// Real-time: a lock with priority inheritance, held for a few instructions; end_by, resume and
/// close pass over the calls in flight.
template <class Callback>
class PendingCalls {
 public:
  explicit PendingCalls(const ClientOptions& options)
      : timeout_(options.timeout), end_(options.calls_in_flight), calls_(end_ + 1) {
    for (std::size_t place = 0; place < end_; ++place) calls_[place].after = place + 1;
    calls_[end_].before = calls_[end_].after = end_;
  }

  /// The number of the new call; nothing: as many are in flight as may be. `awaited`, if there is
  /// one, is answered instead of the callback.
  std::optional<std::int64_t> begin(TimePoint now, Callback callback,
                                    AwaitedAnswer* awaited = nullptr) noexcept {
    const std::lock_guard lock(mutex_);
    if (free_ == end_) return std::nullopt;
    Call& call = calls_[free_];
    const std::size_t place = std::exchange(free_, call.after);
    call.sequence = static_cast<std::int64_t>(begun_++ * end_ + place + 1);
    call.deadline = call.timeout = timeout_ == Nanoseconds::zero() ? kNever : later(now, timeout_);
    call.callback = std::move(callback);
    call.awaited = awaited;
    call.after = end_;
    call.before = std::exchange(calls_[end_].before, place);
    calls_[call.before].after = place;
    ++count_;
    if (awaited != nullptr) awaited->sequence = call.sequence;
    return call.sequence;
  }
  /// Last of all that is done to send an awaited call: from then on its coroutine may be anywhere.
  void sent(AwaitedAnswer& awaited) noexcept {
    const std::lock_guard lock(mutex_);
    awaited.sent();
  }
  /// Ends the call. Returns what is to be called with the answer; nothing: there is no such call
  /// (any more), or it was awaited, and the answer is there.
  std::optional<Callback> end(std::int64_t sequence, MessageBlock& response) noexcept {
    const std::lock_guard lock(mutex_);
    Call* call = find(sequence);
    return call != nullptr ? end(*call, &response) : std::nullopt;
  }
  /// The same, without an answer.
  std::optional<Callback> end(std::int64_t sequence) noexcept {
    const std::lock_guard lock(mutex_);
    Call* call = find(sequence);
    return call != nullptr ? end(*call, nullptr) : std::nullopt;
  }
  /// Ends the calls whose time is up. Returns one that is to be called; nothing: there is none any
  /// more.
  std::optional<Callback> end_late(TimePoint now) noexcept {
    const std::lock_guard lock(mutex_);
    for (Call* call = &first(); count_ != 0 && call->deadline <= now; call = &first()) {
      if (call->deadline < call->timeout) ++given_up_;
      if (auto callback = end(*call, nullptr)) return callback;
    }
    return std::nullopt;
  }
  /// Nobody can answer the present calls: they end at this time, or earlier.
  void end_by(TimePoint limit) noexcept {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = calls_[end_].before; i != end_ && calls_[i].deadline > limit;
         i = calls_[i].before) {
      calls_[i].deadline = limit;
    }
  }
  /// Somebody may answer the present calls after all.
  void resume() noexcept {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = calls_[end_].after; i != end_; i = calls_[i].after) {
      calls_[i].deadline = calls_[i].timeout;
    }
  }
  /// How many calls have ended because of end_by, since the last question.
  std::size_t take_given_up() noexcept {
    const std::lock_guard lock(mutex_);
    return std::exchange(given_up_, 0);
  }
  /// The client goes: coroutines that wait get no answer, and no callback is called any more.
  void close() noexcept {
    std::vector<Call> left;  // goes after the lock, as callbacks own whatever they like
    const std::lock_guard lock(mutex_);
    for (std::size_t i = calls_[end_].after; i != end_; i = calls_[i].after) {
      if (auto* awaited = calls_[i].awaited) awaited->answer(nullptr);
    }
    calls_.swap(left);
    calls_.resize(1);
    end_ = free_ = count_ = 0;
  }
  /// It does not wait any more, for its frame is being destroyed.
  void forget(const AwaitedAnswer& awaited) noexcept {
    const std::lock_guard lock(mutex_);
    Call* call = find(awaited.sequence);
    if (call != nullptr && call->awaited == &awaited) leave(*call);
  }
  bool has(std::int64_t sequence) noexcept {
    const std::lock_guard lock(mutex_);
    return find(sequence) != nullptr;
  }
  /// When the next call ends without an answer; kNever when none does.
  TimePoint next_deadline() noexcept {
    const std::lock_guard lock(mutex_);
    return count_ != 0 ? first().deadline : kNever;
  }
  std::size_t count() const noexcept {
    const std::lock_guard lock(mutex_);
    return count_;
  }

 private:
  static constexpr std::int64_t kNoCall = 0;  // the place is free
  struct Call {
    std::int64_t sequence = kNoCall;
    TimePoint deadline{}, timeout{};
    Callback callback;
    AwaitedAnswer* awaited = nullptr;
    std::size_t before = 0, after = 0;  // places of the neighbours; free ones have only `after`
  };

  // With the mutex held, as all that follows. A peer may send any number.
  Call* find(std::int64_t sequence) noexcept {
    if (sequence <= kNoCall || end_ == 0) return nullptr;
    Call& call = calls_[static_cast<std::uint64_t>(sequence - 1) % end_];
    return call.sequence == sequence ? &call : nullptr;
  }
  Call& first() noexcept { return calls_[calls_[end_].after]; }
  void leave(Call& call) noexcept {
    calls_[call.before].after = call.after;
    calls_[call.after].before = call.before;
    call.sequence = kNoCall;
    call.awaited = nullptr;
    call.after = std::exchange(free_, static_cast<std::size_t>(&call - calls_.data()));
    --count_;
  }
  std::optional<Callback> end(Call& call, MessageBlock* response) noexcept {
    AwaitedAnswer* const awaited = call.awaited;
    leave(call);
    if (awaited == nullptr) return std::move(call.callback);
    awaited->answer(response);
    return std::nullopt;
  }

  const Nanoseconds timeout_;
  mutable RankedMutex<LockRank::calls> mutex_;  // guards all below
  std::size_t end_;          // the place behind the last: where the list of calls begins and ends
  std::vector<Call> calls_;  // by place
  std::size_t free_ = 0;     // the first free place, or end_
  std::size_t count_ = 0, given_up_ = 0;
  std::uint64_t begun_ = 0;
};

}  // namespace detail

}  // namespace takt

#endif  // TAKT_ENTITIES_PENDING_CALLS_HPP_
