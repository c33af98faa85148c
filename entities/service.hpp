// Answers requests.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_SERVICE_HPP_
#define TAKT_ENTITIES_SERVICE_HPP_

#include <algorithm>
#include <concepts>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "takt/base/visibility.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/entities/service_message.hpp"
#include "takt/entities/subscription.hpp"

namespace TAKT_PUBLIC takt {

/// Whose call it is, and which of the caller's: as it stands in request and response.
struct RequestId {
  std::uint64_t client = 0;
  std::int64_t sequence = 0;

  friend bool operator==(const RequestId&, const RequestId&) = default;
};

/// Fills in the response, at once or as a coroutine. Or it remembers the id: then other code
/// sends the response later. One that returns a std::exception_ptr has filled in a negative
/// response if there is an exception, which is thrown when the response has been sent.
template <class F, class S>
concept ServiceCallback = std::invocable<F&, const typename S::Request&, typename S::Response&> ||
    std::invocable<F&, const typename S::Request&, RequestId>;

struct ServiceOptions {
  /// How many pending requests it keeps: a further one replaces the oldest, which is counted as
  /// dropped.
  std::size_t depth = kServiceDepth;
  /// Responses that are made in advance; further ones come from the heap. 0: as many as the depth
  /// says, made when they are needed.
  std::size_t loans = kServiceDepth;
  /// The full name of the node that has the service in ROS 2's graph; empty: the node that makes
  /// it. For a service that another node's executor serves.
  std::string graph_node;
};

/// For services that are called rarely, and of which there are many: little memory.
inline ServiceOptions rare_service(const std::string& graph_node = {}) {
  return {.depth = 10, .loans = 0, .graph_node = graph_node};
}

/// A service, as its node creates it: it receives requests as a subscription does, from this
/// process by pointer and from others over DDS, and publishes each response. The callback fills in
/// the response; when it throws, there is none, and the caller's timeout ends the call.
///
/// Thread safety and real-time: as Subscription and Publisher; a call inside the process allocates
/// nothing while at most service_loans() responses are in transit. While DDS has not yet discovered
/// the reader of a client that has called, the service keeps its responses, `depth` at most.
template <ServiceType S>
class Service : public SubscriptionBase {
 public:
  using SharedPtr = std::shared_ptr<Service>;
  using Request = ServiceMessage<typename S::Request>;
  using Response = ServiceMessage<typename S::Response>;

  /// For a callback that takes the RequestId: from any thread, once.
  void send_response(RequestId id, const typename S::Response& response) {
    Answer answer = prepare(id);
    answer->body = response;
    respond(std::move(answer));
  }

 protected:
  Service(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
          const std::string& path, const std::string& node, Clock& clock,
          const ServiceOptions& options, const std::shared_ptr<Participant>& participant)
      : SubscriptionBase(EntityKind::service, name, group,
                         {request_topic(path), &message_type<Request>(), options.depth, node,
                          service_identity<S>(kServiceId, participant)},
                         participant,
                         {&kMakerOf<Request>, std::min<std::size_t>(options.loans, 4)}),
        responses_({reply_topic(path), &message_type<Response>(), options.depth, node,
                    endpoint().identity},
                   clock, {.loans = service_loans<Response>(options.loans)}, participant) {}

  /// A response in transit: lent, or from the heap.
  class Answer {
   public:
    Answer(LoanedMessage<Response> lent, std::unique_ptr<Response> own) noexcept
        : lent_(std::move(lent)), own_(std::move(own)) {}
    Response& operator*() const noexcept { return own_ != nullptr ? *own_ : *lent_; }
    Response* operator->() const noexcept { return &**this; }

   private:
    friend class Service;
    LoanedMessage<Response> lent_;
    std::unique_ptr<Response> own_;
  };

  Answer prepare(RequestId id) {
    static const typename S::Response kEmpty{};
    LoanedMessage<Response> lent =
        responses_.has_loans() ? responses_.borrow_loaned_message() : responses_.place_for_copy();
    Answer answer(std::move(lent), nullptr);
    if (!answer.lent_) answer.own_ = std::make_unique<Response>();
    answer->client = id.client;
    answer->sequence = id.sequence;
    answer->body = kEmpty;  // a loan keeps what its last user wrote
    return answer;
  }
  void respond(Answer answer) {
    if (answer.own_ != nullptr) {
      responses_.publish(std::move(answer.own_));
    } else {
      responses_.publish(std::move(answer.lent_));
    }
  }

 private:
  Publisher<Response> responses_;
};

/// A service with its callback.
/// Thread safety and real-time: as Service.
template <ServiceType S, ServiceCallback<S> F>
class CallbackService final : public Service<S>, private TaskOwner {
  using Base = Service<S>;
  using typename Base::Answer;
  using typename Base::Request;

 public:
  static constexpr bool kIsTask =
      TaskCallback<F, const typename S::Request&, typename S::Response&>;
  static constexpr bool kTellsFailure =
      requires(F & callback, const typename S::Request& request, typename S::Response& response) {
    { callback(request, response) } -> std::same_as<std::exception_ptr>;
  };

  CallbackService(const std::string& name, const std::shared_ptr<CallbackGroup>& group,
                  const std::string& path, const std::string& node, Clock& clock, F callback,
                  const ServiceOptions& options, const std::shared_ptr<Participant>& participant)
      : Base(name, group, path, node, clock, options, participant),
        callback_(std::move(callback)) {}
  /// For a callback that is a coroutine; before the first request.
  void set_runner(std::shared_ptr<TaskRunner> runner) {
    runner_ = std::move(runner);
    runner_->set_owner_of_tasks(*this);
  }

  std::size_t ready_count() const noexcept override {
    return runner_ == nullptr || runner_->is_free() ? Base::ready_count() : 0;
  }
  bool take(Slot& slot) noexcept override {
    if (runner_ != nullptr && !runner_->reserve()) return false;
    if (Base::take(slot)) return true;
    if (runner_ != nullptr) runner_->give_back();
    return false;
  }
  void execute(Slot& slot) override {
    MessageBlock* block = slot.message;
    TakenMessage<Request> request(block, static_cast<const Request*>(block->payload()));
    const RequestId id{request->client, request->sequence};
    if constexpr (kIsTask) {
      runner_->start([&] { return serve(std::move(request), Base::prepare(id)); });
    } else if constexpr (std::invocable<F&, const typename S::Request&, typename S::Response&>) {
      Answer answer = Base::prepare(id);
      if constexpr (kTellsFailure) {
        const std::exception_ptr failure = callback_(request->body, answer->body);
        Base::respond(std::move(answer));
        if (failure) std::rethrow_exception(failure);
      } else {
        callback_(request->body, answer->body);
        Base::respond(std::move(answer));
      }
    } else {
      callback_(request->body, id);
    }
  }
  void discard(Slot& slot) noexcept override {
    Base::discard(slot);
    if (runner_ != nullptr) runner_->give_back();
  }
  void retire() noexcept override {
    Base::retire();
    if (runner_ != nullptr) runner_->retire();
  }
  void retired(std::shared_ptr<Entity> self) noexcept override {
    if (runner_ != nullptr) runner_->keep(std::move(self));
  }

 private:
  Task<> serve(TakenMessage<Request> request, Answer answer) {
    co_await callback_(request->body, answer->body);
    Base::respond(std::move(answer));
  }
  void task_ended() noexcept override { this->announce_if_ready(); }

  F callback_;
  std::shared_ptr<TaskRunner> runner_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_SERVICE_HPP_
