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
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/base/lockfree/cells.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/entities/client.hpp"

#include "rclcpp/clock.hpp"
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
/// Waits until `is_true()`, the timeout (negative: none) or the shutdown of the context. Polls
/// every few milliseconds: discovery goes on in Takt's threads.
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

/// Thread safety: every method from any thread. Real-time: the futures and responses of up to 16
/// pending calls come from a pool, their strings and sequences from the heap. A call takes only
/// locks with priority inheritance. A callback that is larger than a pointer is allocated.
class ClientBase : public detail::ServiceIntrospection {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(ClientBase)
  virtual ~ClientBase() = default;
  ClientBase(const ClientBase&) = delete;
  ClientBase& operator=(const ClientBase&) = delete;

  const char* get_service_name() const { return name_.c_str(); }
  virtual bool service_is_ready() const = 0;
  /// Works without a spin. False at the timeout, or when the context is shut down.
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
    auto call = begin<SharedResponse>();
    Future future = call->promise.get_future();
    return FutureAndRequestId(std::move(future), send(*request, std::move(call)));
  }
  /// The callback gets a future that is ready.
  template <class F>
  requires std::invocable<F&, SharedFuture> SharedFutureAndRequestId
  async_send_request(SharedRequest request, F&& callback) {
    auto call = begin<SharedResponse>();
    SharedFuture future = call->future = call->promise.get_future().share();
    call->callback = std::forward<F>(callback);
    return SharedFutureAndRequestId(std::move(future), send(*request, std::move(call)));
  }
  template <class F>
  requires(std::invocable<F&, SharedFutureWithRequest> &&
           !std::invocable<F&, SharedFuture>) SharedFutureWithRequestAndRequestId
      async_send_request(SharedRequest request, F&& callback) {
    auto call = begin<std::pair<SharedRequest, SharedResponse>>();
    SharedFutureWithRequest future = call->future = call->promise.get_future().share();
    call->callback = std::forward<F>(callback);
    call->request = request;
    return SharedFutureWithRequestAndRequestId(std::move(future), send(*request, std::move(call)));
  }

  /// Drops the response to this request. Returns whether the request was pending.
  bool remove_pending_request(std::int64_t id) { return typed()->forget(id); }
  template <class F>
  bool remove_pending_request(const detail::FutureAndRequestId<F>& request) {
    return remove_pending_request(request.request_id);
  }
  /// Drops all pending requests. Returns their number.
  std::size_t prune_pending_requests() {
    return prune([](auto) { return true; }, nullptr);
  }
  /// Drops the pending requests that were sent before this time, and appends their ids to `pruned`,
  /// if given.
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

  /// A pending request; allocated from `cells_`, as are its promise and its response.
  template <class Value>
  struct Call {
    explicit Call(std::shared_ptr<const takt::Cells> from) : cells(std::move(from)) {}
    void end(const Response& received) {
      auto response = std::allocate_shared<Response>(cells->allocator(), received);
      if constexpr (std::is_same_v<Value, SharedResponse>) {
        promise.set_value(std::move(response));
      } else {
        promise.set_value({std::move(request), std::move(response)});
      }
      if (callback) callback(future);
    }

    const std::shared_ptr<const takt::Cells> cells;
    std::promise<Value> promise{std::allocator_arg, cells->allocator()};
    SharedRequest request;             // for a Value that contains it
    std::shared_future<Value> future;  // for the callback
    std::function<void(std::shared_future<Value>)> callback;
  };
  template <class Value>
  std::shared_ptr<Call<Value>> begin() const {
    return std::allocate_shared<Call<Value>>(cells_->allocator(), cells_);
  }
  template <class Value>
  std::int64_t send(const Request& request, std::shared_ptr<Call<Value>> call) {
    const auto now = detail::system_now();
    const std::int64_t id =
        typed()->async_send_request(request, [call = std::move(call)](const Response* response) {
          if (response != nullptr) call->end(*response);
        });
    const std::lock_guard lock(mutex_);
    Sent& place = sent_[static_cast<std::uint64_t>(id) % kMostRequests];
    if (place.id < id) place = {id, now};  // else the call has ended; a later one is here
    return id;
  }
  template <class Condition>
  std::size_t prune(Condition&& is_meant, std::vector<std::int64_t>* pruned) {
    std::vector<std::int64_t> ended;
    for (const Sent& place : sent_) {
      mutex_.lock();
      const auto [id, time] = place;
      mutex_.unlock();
      // False if the response has come meanwhile.
      if (is_meant(time) && remove_pending_request(id)) ended.push_back(id);
    }
    std::sort(ended.begin(), ended.end());  // in the order of sending
    if (pruned != nullptr) pruned->insert(pruned->end(), ended.begin(), ended.end());
    return ended.size();
  }

  // Limit: requests of a client of rclcpp that wait for a response. At it: the next one throws.
  // Seen: the exception.
  static constexpr std::size_t kMostRequests = 1000;
  // Limit: calls whose futures and responses lie in cells. At it: those of further ones come from
  // the heap. Seen: `takt run --allocations`.
  static constexpr std::size_t kMostInCells = 16;
  const std::shared_ptr<const takt::Cells> cells_ = std::make_shared<takt::Cells>(
      4 * kMostInCells,  // the call, two for its promise, the response
      std::max(sizeof(Call<std::pair<SharedRequest, SharedResponse>>), sizeof(Response)) + 64);
  struct Sent {
    std::int64_t id = 0;
    std::chrono::system_clock::time_point time{};
  };
  takt::PiMutex mutex_;
  std::vector<Sent> sent_ = std::vector<Sent>(kMostRequests);  // guarded by mutex_; by id % size
};

}  // namespace rclcpp

#endif  // RCLCPP__CLIENT_HPP_
