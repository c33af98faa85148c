// Answers requests.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_SERVICE_HPP_
#define TAKT_ENTITIES_SERVICE_HPP_

#include <algorithm>
#include <atomic>
#include <chrono>
#include <concepts>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "takt/entities/publisher.hpp"
#include "takt/entities/service_message.hpp"
#include "takt/entities/subscription.hpp"

namespace takt {

template <class F, class S>
concept ServiceCallback = std::invocable<F&, const typename S::Request&, typename S::Response&>;

struct ServiceOptions {
  /// How many requests it keeps that it has not served: what comes beyond replaces the oldest, and
  /// is counted as dropped.
  std::size_t depth = kServiceDepth;
  /// Responses that are made in advance; when they are out, the heap has more. For services that
  /// allocate anyway: 0.
  std::size_t loans = kServiceDepth;
};

/// For a service that is called now and then, and of which there are many: little memory.
inline constexpr ServiceOptions kRareService{.depth = 10, .loans = 0};

/// A service as its node hands it out: it receives requests as a subscription does, from this
/// process by pointer and from others over DDS, and publishes each response. The callback fills in
/// the response; when it throws, there is none, and the caller's time-out tells.
///
/// Thread safety and real-time: as Subscription and Publisher; a call inside the process allocates
/// nothing while at most service_loans() responses are on their way. A call from another process
/// that has just come waits, up to 100 ms, until DDS has found the way back.
template <ServiceType S>
class Service : public SubscriptionBase {
 public:
  using Request = ServiceMessage<typename S::Request>;
  using Response = ServiceMessage<typename S::Response>;

 protected:
  Service(std::string name, std::shared_ptr<CallbackGroup> group, const std::string& path,
          Clock& clock, const ServiceOptions& options,
          const std::shared_ptr<Participant>& participant)
      : SubscriptionBase(EntityKind::service, std::move(name), std::move(group),
                         {request_topic(path), &message_type<Request>(), options.depth},
                         participant),
        has_loans_(options.loans != 0),
        decoded_(participant != nullptr ? std::min<std::size_t>(options.loans, 4) : 0),
        responses_(reply_topic(path), options.depth, clock,
                   {.loans = service_loans<Response>(options.loans)}, participant) {}

  void respond(LoanedMessage<Response> response) noexcept {
    wait_for_caller();
    responses_.publish(std::move(response));
  }
  void respond(std::unique_ptr<Response> response) {
    wait_for_caller();
    responses_.publish(std::move(response));
  }
  LoanedMessage<Response> borrow() {
    return has_loans_ ? responses_.borrow_loaned_message() : LoanedMessage<Response>();
  }

 private:
  MessageBlock* decode(std::span<const std::byte> bytes) noexcept final {
    return decoded_.decode(bytes);
  }

  // A request may come before the caller's other end, which the answer goes to, has been found:
  // then the answer would be lost. ROS 2's servers wait for it as long.
  void wait_for_caller() noexcept {
    const auto callers = [this] { return outside_publisher_count(); };
    for (int i = 0; i < 100 && callers() > responses_.outside_subscription_count() &&
                    callers() > callers_without_ear_;
         ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    const std::size_t ears = responses_.outside_subscription_count();
    callers_without_ear_ = callers() > ears ? callers() : 0;  // not for them again
  }

  const bool has_loans_;
  DecodedMessages<Request> decoded_;
  Publisher<Response> responses_;
  std::atomic<std::size_t> callers_without_ear_{0};
};

template <ServiceType S, ServiceCallback<S> F>
class CallbackService final : public Service<S> {
 public:
  CallbackService(std::string name, std::shared_ptr<CallbackGroup> group, const std::string& path,
                  Clock& clock, F callback, const ServiceOptions& options,
                  const std::shared_ptr<Participant>& participant)
      : Service<S>(std::move(name), std::move(group), path, clock, options, participant),
        callback_(std::move(callback)) {}

  void execute(Slot& slot) override {
    const std::unique_ptr<MessageBlock, Release> held(slot.message);
    const auto& request = *static_cast<const typename Service<S>::Request*>(held->payload());
    if (auto loan = this->borrow()) {
      answer(request, *loan);
      this->respond(std::move(loan));
    } else {
      auto own = std::make_unique<typename Service<S>::Response>();
      answer(request, *own);
      this->respond(std::move(own));
    }
  }

 private:
  struct Release {
    void operator()(MessageBlock* block) const noexcept { block->release(); }
  };

  void answer(const typename Service<S>::Request& request,
              typename Service<S>::Response& response) {
    static const typename S::Response kEmpty{};
    response.client = request.client;
    response.sequence = request.sequence;
    response.body = kEmpty;  // a loan keeps what its last user wrote
    callback_(request.body, response.body);
  }

  F callback_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_SERVICE_HPP_
