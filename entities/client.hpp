// Calls services, without waiting.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_CLIENT_HPP_
#define TAKT_ENTITIES_CLIENT_HPP_

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/future.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/entities/service_message.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/entities/task_runner.hpp"
#include "takt/entities/timer.hpp"

namespace TAKT_PUBLIC takt {

struct ClientOptions {
  /// Limit of outstanding calls; one more throws an Error.
  std::size_t calls_in_flight = 100;
  /// The timeout of a call, after which it ends without an answer. 0: none.
  Nanoseconds timeout{0};
};

namespace detail {

[[noreturn]] void refuse_call(const std::string& service, std::size_t waiting);

/// A coroutine that waits for an answer. It goes on when its call has been sent and is over: while
/// it is being sent, both the request in the coroutine's frame and the client, which the coroutine
/// may drop, are needed.
struct AwaitedAnswer : Waiting {
  MessageBlock* response = nullptr;  // none: no answer came in time
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

/// The calls that wait for an answer, with what is to be done then.
/// Thread safety: from any thread.
/// Real-time: a lock with priority inheritance, held while at most `calls_in_flight` places are
/// looked at.
template <class Callback>
class PendingCalls {
 public:
  explicit PendingCalls(const ClientOptions& options)
      : timeout_(options.timeout), calls_(options.calls_in_flight) {}

  /// The number of the new call; nothing: as many are in flight as may be. `awaited`, if there is
  /// one, is answered instead of the callback.
  std::optional<std::int64_t> begin(TimePoint now, Callback callback,
                                    AwaitedAnswer* awaited = nullptr) noexcept {
    const std::lock_guard lock(mutex_);
    Call* free = find([](const Call& call) { return call.sequence == kNoCall; });
    if (free == nullptr) return std::nullopt;
    *free = {++last_sequence_, timeout_ == Nanoseconds::zero() ? kNever : later(now, timeout_),
             std::move(callback), awaited};
    return free->sequence;
  }
  /// Last of all that is done to send an awaited call: from then on its coroutine may be anywhere.
  void sent(AwaitedAnswer& awaited) noexcept {
    const std::lock_guard lock(mutex_);
    awaited.sent();
  }
  /// Ends the call. Returns what is to be called with the answer; nothing: there is no such call
  /// (any more), or it was awaited, and the answer is there.
  std::optional<Callback> end(std::int64_t sequence, MessageBlock& response) noexcept {
    if (sequence == kNoCall) return std::nullopt;  // a peer may send what it likes
    const std::lock_guard lock(mutex_);
    Call* call = find([=](const Call& known) { return known.sequence == sequence; });
    return call != nullptr ? end(*call, &response) : std::nullopt;
  }
  /// Ends the calls whose time is up. Returns one that is to be called; nothing: there is none any
  /// more.
  std::optional<Callback> end_late(TimePoint now) noexcept {
    const std::lock_guard lock(mutex_);
    while (Call* call = find([=](const Call& known) {
             return known.sequence != kNoCall && known.deadline <= now;
           })) {
      if (auto callback = end(*call, nullptr)) return callback;
    }
    return std::nullopt;
  }
  /// The client goes: coroutines that wait get no answer, and no callback is called any more.
  void close() noexcept {
    std::vector<Call> left;  // goes after the lock, as callbacks own whatever they like
    const std::lock_guard lock(mutex_);
    while (Call* call = find([](const Call& known) { return known.awaited != nullptr; })) {
      end(*call, nullptr);
    }
    calls_.swap(left);
  }
  /// It does not wait any more, for its frame is being destroyed.
  void forget(const AwaitedAnswer& awaited) noexcept {
    const std::lock_guard lock(mutex_);
    if (Call* call = find([&](const Call& known) { return known.awaited == &awaited; })) {
      *call = {};
    }
  }
  /// When the next call ends without an answer; kNever when none does.
  TimePoint next_deadline() const noexcept {
    const std::lock_guard lock(mutex_);
    TimePoint first = kNever;
    for (const Call& call : calls_) {
      if (call.sequence != kNoCall) first = std::min(first, call.deadline);
    }
    return first;
  }
  std::size_t count() const noexcept {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::count_if(
        calls_.begin(), calls_.end(), [](const Call& call) { return call.sequence != kNoCall; }));
  }

 private:
  static constexpr std::int64_t kNoCall = 0;  // the place is free
  struct Call {
    std::int64_t sequence = kNoCall;
    TimePoint deadline{};
    Callback callback;
    AwaitedAnswer* awaited = nullptr;
  };
  template <class Condition>
  Call* find(Condition&& condition) noexcept {
    const auto call = std::find_if(calls_.begin(), calls_.end(), condition);
    return call == calls_.end() ? nullptr : &*call;
  }
  static std::optional<Callback> end(Call& call, MessageBlock* response) noexcept {
    call.sequence = kNoCall;
    AwaitedAnswer* awaited = std::exchange(call.awaited, nullptr);
    if (awaited == nullptr) return std::move(call.callback);
    awaited->answer(response);
    return std::nullopt;
  }

  const Nanoseconds timeout_;
  mutable PiMutex mutex_;
  std::vector<Call> calls_;
  std::int64_t last_sequence_ = 0;
};

}  // namespace detail

/// A number that no other client has.
std::uint64_t new_client_id();

/// A client, as its node creates it. Answers come to the executor like messages, so a thread that
/// waits for one must let the executor spin: a callback that blocks until its own executor serves
/// the answer waits for ever, as in every executor. A callback that is a coroutine does not block:
/// see Task.
///
/// Thread safety: every method from any thread.
/// Real-time: a call with a callback that fits into std::function allocates nothing inside the
/// process; the other form allocates its future. With services in other processes see Participant.
template <ServiceType S>
class Client : public SubscriptionBase {
 public:
  using SharedPtr = std::shared_ptr<Client>;
  using Request = ServiceMessage<typename S::Request>;
  using Response = ServiceMessage<typename S::Response>;
  /// nothing: no answer came in time.
  using Answer = std::optional<typename S::Response>;
  /// nullptr: no answer came in time.
  using AnswerCallback = std::function<void(const typename S::Response*)>;

  Client(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
         const std::string& path, const std::string& node, Clock& clock,
         const ClientOptions& options, const std::shared_ptr<Participant>& participant)
      : SubscriptionBase(EntityKind::client, name, group,
                         {reply_topic(path), &message_type<Response>(),
                          std::max<std::size_t>(options.calls_in_flight, 1), node,
                          service_identity<S>(kClientId, participant)},
                         participant, {&kMakerOf<Response>, 4}),
        clock_(clock),
        id_(new_client_id()),
        path_(path),
        pending_(std::make_shared<detail::PendingCalls<AnswerCallback>>(options)),
        requests_({request_topic(path), &message_type<Request>(), kServiceDepth, node,
                   endpoint().identity},
                  clock, {.loans = service_loans<Request>(options.calls_in_flight)}, participant) {
    set_address(id_);
  }

  /// Whether a service would receive a call now.
  bool service_is_ready() const noexcept {
    return requests_.local_subscription_count() != 0 ||
           (requests_.subscription_count() != 0 && outside_publisher_count() != 0);
  }

  /// The answer comes to the callback, which runs as this client's callback. It may be empty: then
  /// the answer is dropped. Throws Error beyond ClientOptions::calls_in_flight.
  void async_send_request(const typename S::Request& request, AnswerCallback callback) {
    send(request, std::move(callback));
  }
  /// The answer comes to the future, see Executor::spin_until_future_complete.
  Future<Answer> async_send_request(const typename S::Request& request) {
    Promise<Answer> promise;
    const Future<Answer> future = promise.get_future();
    send(request, [promise = std::move(promise)](const typename S::Response* response) mutable {
      promise.set_value(response != nullptr ? Answer(*response) : Answer());
    });
    return future;
  }
  /// For coroutines: `if (auto answer = co_await client->call(request)) ... answer->sum`. False: no
  /// answer came in time, or the client has gone. Throws Error beyond
  /// ClientOptions::calls_in_flight. The request must live until co_await waits.
  class Call;
  Call call(const typename S::Request& request) { return Call(*this, request); }
  std::size_t calls_in_flight() const noexcept { return pending_->count(); }

  void execute(Slot& slot) override {
    const HeldMessage held(slot.message);
    const auto& response = *static_cast<const Response*>(held->payload());
    const auto callback = pending_->end(response.sequence, *held);
    if (callback && *callback) (*callback)(&response.body);
  }
  void retire() noexcept override {
    SubscriptionBase::retire();
    if (timer_ != nullptr) timer_->retire();
    pending_->close();
  }

  // For Node.

  /// The timer that ends calls without an answer, cancelled; it is the client's from then on.
  void set_timer(std::shared_ptr<Timer> timer) { timer_ = std::move(timer); }
  void end_late_calls() {
    const auto callback = pending_->end_late(clock_.now());
    set_alarm();  // before the callback, which may throw; the next call may be late already
    if (callback && *callback) (*callback)(nullptr);
  }

 private:
  void send(const typename S::Request& request, AnswerCallback callback,
            detail::AwaitedAnswer* awaited = nullptr) {
    const std::shared_ptr<detail::PendingCalls<AnswerCallback>> pending = pending_;
    const auto sequence = pending->begin(clock_.now(), std::move(callback), awaited);
    if (!sequence) {
      detail::refuse_call(path_, pending->count());
    }
    if (timer_ != nullptr) set_alarm();
    if (auto loan = requests_.borrow_loaned_message()) {
      *loan = Request{id_, *sequence, request};
      requests_.publish(std::move(loan));
    } else {
      requests_.publish(std::make_unique<Request>(Request{id_, *sequence, request}));
    }
    if (awaited != nullptr) pending->sent(*awaited);
  }
  // For the first call that ends without an answer. Of two threads that do this, the later one
  // knows all calls.
  void set_alarm() noexcept {
    const std::lock_guard lock(alarm_mutex_);
    const TimePoint deadline = pending_->next_deadline();
    if (timer_->next_release() != deadline) timer_->release_at(deadline);
  }

  Clock& clock_;
  const std::uint64_t id_;
  const std::string path_;
  const std::shared_ptr<detail::PendingCalls<AnswerCallback>>
      pending_;  // with coroutines that wait
  PiMutex alarm_mutex_;
  Publisher<Request> requests_;
  std::shared_ptr<Timer> timer_;
};

template <ServiceType S>
class Client<S>::Call {
 public:
  Call(Client& client, const typename S::Request& request) noexcept
      : client_(client), request_(request) {}
  ~Call() {
    if (awaited_.runner != nullptr) {
      pending_->forget(awaited_);
      awaited_.runner->forget(awaited_);
    }
    if (awaited_.response != nullptr) awaited_.response->release();
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  bool await_ready() const noexcept { return false; }
  template <class Promise>
  void await_suspend(std::coroutine_handle<Promise> coroutine) {
    pending_ = client_.pending_;
    awaited_.suspend(coroutine);
    client_.send(request_, {}, &awaited_);
  }
  TakenMessage<typename S::Response> await_resume() noexcept {
    MessageBlock* block = std::exchange(awaited_.response, nullptr);
    if (block == nullptr) return {};
    return {block, &static_cast<const Response*>(block->payload())->body};
  }

 private:
  Client& client_;
  const typename S::Request& request_;
  std::shared_ptr<detail::PendingCalls<AnswerCallback>> pending_;
  detail::AwaitedAnswer awaited_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_CLIENT_HPP_
