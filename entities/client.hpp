// Calls services, without waiting.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_CLIENT_HPP_
#define TAKT_ENTITIES_CLIENT_HPP_

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/future.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/user_function.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/pending_calls.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/entities/service_message.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/entities/task_runner.hpp"
#include "takt/entities/timer.hpp"

namespace TAKT_PUBLIC takt {

namespace detail {

[[noreturn]] void refuse_call(const std::string& service, std::size_t waiting);
void warn_of_ended_calls(const std::string& service, std::size_t calls);

}  // namespace detail

/// A number that no other client has.
std::uint64_t new_client_id();

/// A client, as its node creates it. Answers come to the executor like messages, so a thread that
/// waits for one must let the executor spin: a callback that blocks until its own executor serves
/// the answer waits for ever, as in every executor. A callback that is a coroutine does not block:
/// see Task.
///
/// Thread safety: every method from any thread.
/// Real-time: a call with a callback that is no larger than a std::function allocates nothing
/// inside the process; the other form allocates its future. With services in other processes see
/// Participant.
template <ServiceType S>
class Client : public SubscriptionBase, private EndpointEvents::Listener {
 public:
  using SharedPtr = std::shared_ptr<Client>;
  using Request = ServiceMessage<typename S::Request>;
  using Response = ServiceMessage<typename S::Response>;
  /// nothing: no answer came in time, or no service could give one.
  using Answer = std::optional<typename S::Response>;
  /// nullptr: the same.
  using AnswerCallback = detail::UserFunction<void(const typename S::Response*)>;

  Client(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
         const std::string& path, const std::string& node, Clock& clock,
         const ClientOptions& options, const std::shared_ptr<Participant>& participant)
      : SubscriptionBase(EntityKind::client, name, group,
                         {reply_topic(path), &message_type<Response>(),
                          std::max<std::size_t>(options.calls_in_flight, 1), node,
                          service_identity<S>(kClientId, participant)},
                         participant, {&kMakerOf<Response>, 4}),
        clock_(clock),
        options_(options),
        id_(new_client_id()),
        path_(path),
        pending_(std::make_shared<Pending>(options)),
        kept_(options.repeats ? options.calls_in_flight : 0),
        requests_({request_topic(path), &message_type<Request>(), kServiceDepth, node,
                   endpoint().identity},
                  clock, {.loans = service_loans<Request>(options.calls_in_flight)}, participant) {
    set_address(id_);
  }

  /// With all namespaces.
  const std::string& service_name() const noexcept { return path_; }
  /// Whether a service would receive a call now.
  bool service_is_ready() const noexcept {
    return requests_.local_subscription_count() != 0 ||
           (requests_.subscription_count() != 0 && outside_publisher_count() != 0);
  }

  /// The answer comes to the callback, which runs as this client's callback. It may be empty: then
  /// the answer is dropped. Returns the call's number; those in flight differ modulo
  /// ClientOptions::calls_in_flight, beyond which it throws Error.
  std::int64_t async_send_request(const typename S::Request& request, AnswerCallback callback) {
    return send(request, std::move(callback));
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
  /// answer came in time, no service could give one, or the client has gone. Throws Error beyond
  /// ClientOptions::calls_in_flight. The request must live until co_await waits.
  class Call;
  Call call(const typename S::Request& request) { return Call(*this, request); }
  std::size_t calls_in_flight() const noexcept { return pending_->count(); }
  bool is_pending(std::int64_t call) const noexcept { return pending_->has(call); }
  /// Ends the call without its answer: its callback is dropped. False if it has ended already.
  bool forget(std::int64_t call) { return pending_->end(call).has_value(); }

  void execute(Slot& slot) override {
    const HeldMessage held(slot.message);
    const auto& response = *static_cast<const Response*>(held->payload());
    const auto callback = pending_->end(response.sequence, *held);
    if (callback && *callback) (*callback)(&response.body);
  }
  void retire() noexcept override {
    requests_.events()->remove_listener(EndpointEvent::matched, this);
    wait_for_readers();
    SubscriptionBase::retire();
    if (timer_ != nullptr) timer_->retire();
    pending_->close();
  }

  // For Node.

  /// The timer that ends calls without an answer, cancelled; it is the client's from then on.
  void set_timer(std::shared_ptr<Timer> timer) {
    timer_ = std::move(timer);
    if (options_.without_service != Nanoseconds::max()) {
      requests_.events()->set_listener(EndpointEvent::matched, this);
    }
  }
  void end_late_calls() {
    if (has_to_repeat_.exchange(false)) repeat_calls();
    const auto callback = pending_->end_late(clock_.now());
    if (const std::size_t calls = pending_->take_given_up(); calls != 0) {
      detail::warn_of_ended_calls(path_, calls);
    }
    set_alarm();  // before the callback, which may throw; the next call may be late already
    if (callback && *callback) (*callback)(nullptr);
  }

 private:
  using Pending = detail::PendingCalls<AnswerCallback>;
  /// Of a call that may have to be repeated.
  struct Kept {
    std::int64_t sequence = 0;
    typename S::Request request{};
  };

  std::int64_t send(const typename S::Request& request, AnswerCallback callback,
                    detail::AwaitedAnswer* awaited = nullptr) {
    const std::shared_ptr<Pending> pending = pending_;
    const auto sequence = pending->begin(clock_.now(), std::move(callback), awaited);
    if (!sequence) {
      detail::refuse_call(path_, pending->count());
    }
    if (options_.repeats) keep(*sequence, request);
    if (timer_ != nullptr) {
      const bool is_lost = end_if_alone();
      if (is_lost || options_.timeout != Nanoseconds::zero()) set_alarm();
    }
    publish(*sequence, request);
    if (awaited != nullptr) pending->sent(*awaited);
    return *sequence;
  }
  void publish(std::int64_t sequence, const typename S::Request& request) {
    if (auto loan = requests_.borrow_loaned_message()) {
      *loan = Request{id_, sequence, request};
      requests_.publish(std::move(loan));
    } else {
      requests_.publish(std::make_unique<Request>(Request{id_, sequence, request}));
    }
  }
  void keep(std::int64_t sequence, const typename S::Request& request) {
    Kept kept{sequence, request};  // and what it replaces goes after the lock
    const std::lock_guard lock(kept_mutex_);
    std::swap(kept_[static_cast<std::uint64_t>(sequence) % kept_.size()], kept);
  }
  void repeat_calls() {
    pending_->resume();
    end_if_alone();
    for (Kept& place : kept_) {
      Kept kept;
      {
        const std::lock_guard lock(kept_mutex_);
        if (!pending_->has(place.sequence)) continue;
        kept = place;
      }
      publish(kept.sequence, kept.request);
    }
  }

  // Services come and go: step by step,
  // 1. the end of the requests counts it, and calls `happened`, on any thread;
  // 2. that gives calls which nobody can answer a limit, and sets the timer;
  // 3. which ends them, as this client's callback.
  // A call that begins meanwhile is in `pending_` before it looks for a service: so either 2. finds
  // it, or it finds none itself.
  void happened() noexcept override {
    if (pending_->count() == 0) return;  // so discovery does not wake who does not call
    if (!end_if_alone()) {
      if (!options_.repeats) return;
      has_to_repeat_.store(true);
    }
    set_alarm();
  }
  bool end_if_alone() noexcept {
    const bool is_alone = options_.without_service != Nanoseconds::max() &&
                          requests_.events()->status(MatchedStatus{}).current_count <= 0;
    if (is_alone) pending_->end_by(later(clock_.now(), options_.without_service));
    return is_alone;
  }
  // For the first call that ends without an answer. Of two threads that do this, the later one
  // knows all calls.
  void set_alarm() noexcept {
    const std::lock_guard lock(alarm_mutex_);
    const TimePoint due = has_to_repeat_.load() ? clock_.now() : pending_->next_deadline();
    if (timer_->next_release() != due) timer_->release_at(due);
  }

  Clock& clock_;
  const ClientOptions options_;
  const std::uint64_t id_;
  const std::string path_;
  const std::shared_ptr<Pending> pending_;  // with coroutines that wait
  RankedMutex<LockRank::kept_requests> kept_mutex_;
  std::vector<Kept> kept_;  // by place
  std::atomic<bool> has_to_repeat_{false};
  RankedMutex<LockRank::client_alarm> alarm_mutex_;
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
  std::shared_ptr<Pending> pending_;
  detail::AwaitedAnswer awaited_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_CLIENT_HPP_
