// Clients of services, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__CLIENT_HPP_
#define RCLCPP__CLIENT_HPP_

#include <algorithm>
#include <chrono>
#include <concepts>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "takt/entities/client.hpp"

#include "rclcpp/detail/refused.hpp"
#include "rclcpp/detail/service_introspection.hpp"
#include "rclcpp/macros.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/qos.hpp"

namespace rclcpp {

enum class FutureReturnCode { SUCCESS, INTERRUPTED, TIMEOUT };
std::string to_string(FutureReturnCode code);
std::ostream& operator<<(std::ostream& stream, FutureReturnCode code);

namespace detail {
/// Until `is_true`, the time is over (negative: never), or the context is shut down. It asks every
/// few milliseconds: Takt's threads of discovery go on meanwhile.
bool wait_for(Context& context, std::chrono::nanoseconds timeout,
              const std::function<bool()>& is_true);

/// A future, and the number of its request.
template <class Future>
struct FutureAndRequestId {
  Future future;
  std::int64_t request_id;

  FutureAndRequestId(Future result, std::int64_t id) : future(std::move(result)), request_id(id) {}
  FutureAndRequestId(FutureAndRequestId&&) noexcept = default;
  FutureAndRequestId& operator=(FutureAndRequestId&&) noexcept = default;
  FutureAndRequestId(const FutureAndRequestId&) = default;
  FutureAndRequestId& operator=(const FutureAndRequestId&) = default;

  operator Future&() { return future; }  // NOLINT: as in rclcpp
  auto get() { return future.get(); }
  bool valid() const noexcept { return future.valid(); }
  void wait() const { future.wait(); }  // Waits for an answer: the user's own wait
  template <class Rep, class Period>
  std::future_status wait_for(const std::chrono::duration<Rep, Period>& timeout) const {
    return future.wait_for(timeout);
  }
  template <class Clock, class Duration>
  std::future_status wait_until(const std::chrono::time_point<Clock, Duration>& time) const {
    return future.wait_until(time);
  }
};
}  // namespace detail

/// Thread safety: every method from any thread. Real-time: each call allocates its future.
class ClientBase : public detail::ServiceIntrospection {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(ClientBase)
  virtual ~ClientBase() = default;
  ClientBase(const ClientBase&) = delete;
  ClientBase& operator=(const ClientBase&) = delete;

  const char* get_service_name() const { return name_.c_str(); }
  virtual bool service_is_ready() const = 0;
  /// Needs no spin. False at a shutdown, too.
  template <class Rep = std::int64_t, class Period = std::milli>
  bool wait_for_service(
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
    return detail::wait_for(*context_,
                            std::chrono::duration_cast<std::chrono::nanoseconds>(timeout),
                            [this] { return service_is_ready(); });
  }
  RCLCPP_REFUSED_(get_client_handle, "rcl's handles")
  RCLCPP_REFUSED_(set_on_new_response_callback, "callbacks for what is new")
  RCLCPP_REFUSED_(clear_on_new_response_callback, "callbacks for what is new")
  // For this library.
  const std::shared_ptr<takt::SubscriptionBase>& entity() const { return takt_; }

 protected:
  ClientBase(node_interfaces::NodeBaseInterface& node, std::string path,
             std::shared_ptr<takt::SubscriptionBase> client)
      : takt_(std::move(client)), name_(std::move(path)), context_(node.get_context()) {}

  const std::shared_ptr<takt::SubscriptionBase> takt_;

 private:
  const std::string name_;
  const Context::SharedPtr context_;
};

template <class S>
class Client : public ClientBase {
  using Request = typename S::Request;
  using Response = typename S::Response;

 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(Client)
  using SharedRequest = std::shared_ptr<Request>;
  using SharedResponse = std::shared_ptr<Response>;
  using Promise = std::promise<SharedResponse>;
  using PromiseWithRequest = std::promise<std::pair<SharedRequest, SharedResponse>>;
  using SharedPromise = std::shared_ptr<Promise>;
  using SharedPromiseWithRequest = std::shared_ptr<PromiseWithRequest>;
  using Future = std::future<SharedResponse>;
  using SharedFuture = std::shared_future<SharedResponse>;
  using SharedFutureWithRequest = std::shared_future<std::pair<SharedRequest, SharedResponse>>;
  using CallbackType = std::function<void(SharedFuture)>;
  using CallbackWithRequestType = std::function<void(SharedFutureWithRequest)>;

  struct SharedFutureAndRequestId : detail::FutureAndRequestId<SharedFuture> {
    using detail::FutureAndRequestId<SharedFuture>::FutureAndRequestId;
  };
  struct SharedFutureWithRequestAndRequestId : detail::FutureAndRequestId<SharedFutureWithRequest> {
    using detail::FutureAndRequestId<SharedFutureWithRequest>::FutureAndRequestId;
  };
  struct FutureAndRequestId : detail::FutureAndRequestId<Future> {
    using detail::FutureAndRequestId<Future>::FutureAndRequestId;
    FutureAndRequestId(FutureAndRequestId&&) noexcept = default;
    FutureAndRequestId& operator=(FutureAndRequestId&&) noexcept = default;
    FutureAndRequestId(const FutureAndRequestId&) = delete;
    FutureAndRequestId& operator=(const FutureAndRequestId&) = delete;
    [[deprecated("use share() instead: see docs/reference/rclcpp.md")]]  // NOLINTNEXTLINE
    operator SharedFuture() {
      return this->future.share();
    }
    SharedFuture share() noexcept { return this->future.share(); }
  };

  Client(node_interfaces::NodeBaseInterface& node, const std::string& name, const QoS& qos,
         std::shared_ptr<CallbackGroup> group)
      : Client(node, node.resolve_topic_or_service_name(name, true), std::move(group), qos) {}

  bool service_is_ready() const override { return typed()->service_is_ready(); }

  FutureAndRequestId async_send_request(SharedRequest request) {
    auto promise = std::make_shared<Promise>();
    Future future = promise->get_future();
    const std::int64_t id =
        send(*request, [promise](SharedResponse response) { promise->set_value(response); });
    return FutureAndRequestId(std::move(future), id);
  }
  /// The callback gets a future that is ready.
  template <class F>
  requires std::invocable<F&, SharedFuture> SharedFutureAndRequestId
  async_send_request(SharedRequest request, F&& callback) {
    auto promise = std::make_shared<Promise>();
    SharedFuture future = promise->get_future().share();
    const std::int64_t id =
        send(*request, [promise, future, callback = CallbackType(std::forward<F>(callback))](
                           SharedResponse response) {
          promise->set_value(std::move(response));
          callback(future);
        });
    return SharedFutureAndRequestId(std::move(future), id);
  }
  template <class F>
  requires(std::invocable<F&, SharedFutureWithRequest> &&
           !std::invocable<F&, SharedFuture>) SharedFutureWithRequestAndRequestId
      async_send_request(SharedRequest request, F&& callback) {
    auto promise = std::make_shared<PromiseWithRequest>();
    SharedFutureWithRequest future = promise->get_future().share();
    const std::int64_t id = send(
        *request,
        [request, promise, future,
         callback = CallbackWithRequestType(std::forward<F>(callback))](SharedResponse response) {
          promise->set_value({request, std::move(response)});
          callback(future);
        });
    return SharedFutureWithRequestAndRequestId(std::move(future), id);
  }

  /// Its answer is dropped. Whether it was pending.
  bool remove_pending_request(std::int64_t id) { return typed()->forget(id); }
  template <class F>
  bool remove_pending_request(const detail::FutureAndRequestId<F>& request) {
    return remove_pending_request(request.request_id);
  }
  /// How many there were.
  std::size_t prune_pending_requests() {
    return prune([](auto) { return true; }, nullptr);
  }
  /// Those that were sent before this time; their numbers are added to the list, if there is one.
  std::size_t prune_requests_older_than(std::chrono::time_point<std::chrono::system_clock> time,
                                        std::vector<std::int64_t>* pruned = nullptr) {
    return prune([time](auto sent) { return sent < time; }, pruned);
  }

 private:
  Client(node_interfaces::NodeBaseInterface& node, const std::string& path,
         std::shared_ptr<CallbackGroup> group, const QoS&)
      : ClientBase(node, path,
                   node.takt_node()->create_client<S>(path,
                                                      {.calls_in_flight = kMostRequests,
                                                       .without_service = takt::Nanoseconds::max()},
                                                      std::move(group))) {}
  takt::Client<S>* typed() const { return static_cast<takt::Client<S>*>(takt_.get()); }

  template <class F>
  std::int64_t send(const Request& request, F end) {
    const auto now = std::chrono::system_clock::now();
    const std::int64_t id = typed()->async_send_request(
        request, [end = std::move(end)](const Response* response) mutable {
          if (response != nullptr) end(std::make_shared<Response>(*response));
        });
    const std::lock_guard lock(mutex_);
    if (sent_.size() >= kMostRequests) {
      std::erase_if(sent_, [this](const auto& known) { return !typed()->is_pending(known.first); });
    }
    sent_.emplace_back(id, now);
    return id;
  }
  using Sent = std::vector<std::pair<std::int64_t, std::chrono::system_clock::time_point>>;
  template <class Condition>
  std::size_t prune(Condition&& is_meant, std::vector<std::int64_t>* pruned) {
    Sent meant;
    {
      const std::lock_guard lock(mutex_);
      const auto first = std::stable_partition(
          sent_.begin(), sent_.end(), [&](const auto& known) { return !is_meant(known.second); });
      meant.assign(first, sent_.end());
      sent_.erase(first, sent_.end());
    }
    std::size_t count = 0;
    for (const auto& [id, sent] : meant) {
      if (!remove_pending_request(id)) continue;  // it was answered
      if (pruned != nullptr) pruned->push_back(id);
      ++count;
    }
    return count;
  }

  // Limit: requests of a client of rclcpp that wait for a response. At it: the next one throws.
  // Seen: the exception.
  static constexpr std::size_t kMostRequests = 1000;
  std::mutex mutex_;
  Sent sent_;  // guarded by it; with some that are not pending any more
};

}  // namespace rclcpp

#endif  // RCLCPP__CLIENT_HPP_
