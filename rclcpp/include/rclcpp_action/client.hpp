// Action clients, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_ACTION__CLIENT_HPP_
#define RCLCPP_ACTION__CLIENT_HPP_

#include <atomic>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "takt/base/guarded.hpp"
#include "takt/base/lockfree/cells.hpp"
#include "takt/ros2/action_client.hpp"

#include "rclcpp/create_publisher.hpp"
#include "rclcpp/detail/refused.hpp"
#include "rclcpp_action/exceptions.hpp"
#include "rclcpp_action/types.hpp"

namespace rclcpp_action {

template <class A>
class Client;

/// A goal that a server has accepted.
/// Thread safety: every method from any thread. Real-time: nothing blocks.
template <class A>
class ClientGoalHandle {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(ClientGoalHandle)
  struct WrappedResult {
    GoalUUID goal_id;
    ResultCode code;
    typename A::Result::SharedPtr result;
  };
  using Feedback = typename A::Feedback;
  using Result = typename A::Result;
  using FeedbackCallback =
      std::function<void(std::shared_ptr<ClientGoalHandle>, std::shared_ptr<const Feedback>)>;
  using ResultCallback = std::function<void(const WrappedResult&)>;

  explicit ClientGoalHandle(std::shared_ptr<takt::ClientGoalHandle> goal)
      : takt_(std::move(goal)), future_(promise_.get_future().share()) {}

  const GoalUUID& get_goal_id() const { return takt_->id().uuid; }
  rclcpp::Time get_goal_stamp() const { return rclcpp::Time(takt_->stamp()); }
  std::int8_t get_status() { return static_cast<std::int8_t>(takt_->state()); }
  bool is_feedback_aware() { return true; }
  bool is_result_aware() { return is_asked_.load(); }

 private:
  friend class Client<A>;
  /// Replaces the result callback, unless it was called already.
  void set_result_callback(ResultCallback callback) {
    const std::lock_guard lock(mutex_);
    if (!is_told_) callback_.swap(callback);  // the old one is destroyed after the unlock
  }
  /// Completes the future with the result; nullptr: the client was dropped before the result came.
  /// Only the first call counts.
  void end(const takt::GoalResult<A>* ended) {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(has_ended_, true)) return;
    }
    if (ended == nullptr) {
      promise_.set_exception(std::make_exception_ptr(exceptions::UnawareGoalHandleError()));
      return;
    }
    promise_.set_value({get_goal_id(), static_cast<ResultCode>(ended->state),
                        std::make_shared<Result>(ended->result)});
  }
  void tell() {
    ResultCallback callback;
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(is_told_, true)) return;
      callback.swap(callback_);
    }
    if (callback) callback(future_.get());
  }

  const std::shared_ptr<takt::ClientGoalHandle> takt_;
  std::atomic<bool> is_asked_{false};  // the result was requested
  std::mutex mutex_;                   // guards the next ones
  ResultCallback callback_;
  bool has_ended_ = false, is_told_ = false;
  std::promise<WrappedResult> promise_;
  const std::shared_future<WrappedResult> future_;
};

class ClientBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(ClientBase)
  virtual ~ClientBase() = default;
  virtual bool action_server_is_ready() const = 0;
  template <class Rep = std::int64_t, class Period = std::milli>
  bool wait_for_action_server(
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
    return rclcpp::detail::wait_for(*context_,
                                    std::chrono::duration_cast<std::chrono::nanoseconds>(timeout),
                                    [this] { return action_server_is_ready(); });
  }

 protected:
  explicit ClientBase(rclcpp::Context::SharedPtr context) : context_(std::move(context)) {}

 private:
  const rclcpp::Context::SharedPtr context_;
};

/// Thread safety and real-time: as takt::ActionClient; futures allocate. Feedback messages come
/// from a pool, their strings and sequences from the heap.
template <class A>
class Client : public ClientBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(Client)
  using Goal = typename A::Goal;
  using GoalHandle = ClientGoalHandle<A>;
  using WrappedResult = typename GoalHandle::WrappedResult;
  using GoalResponseCallback = std::function<void(typename GoalHandle::SharedPtr)>;
  using FeedbackCallback = typename GoalHandle::FeedbackCallback;
  using ResultCallback = typename GoalHandle::ResultCallback;
  using CancelRequest = action_msgs::srv::CancelGoal::Request;
  using CancelResponse = action_msgs::srv::CancelGoal::Response;
  using CancelCallback = std::function<void(typename CancelResponse::SharedPtr)>;

  struct SendGoalOptions {
    GoalResponseCallback goal_response_callback;
    FeedbackCallback feedback_callback;
    ResultCallback result_callback;
  };

  Client(rclcpp::node_interfaces::NodeBaseInterface& node, const std::string& name,
         rclcpp::CallbackGroup::SharedPtr group)
      : ClientBase(node.get_context()),
        takt_(takt::create_action_client<A>(*node.takt_node(),
                                            node.resolve_topic_or_service_name(name, true),
                                            {.without_server = takt::Nanoseconds::max(),
                                             .most_goals = 100,
                                             .group = std::move(group)})) {}

  bool action_server_is_ready() const override { return takt_->action_server_is_ready(); }

  /// The future gets nullptr when the goal is rejected. The result is requested only if there is a
  /// callback for it. The callbacks of a goal are called one at a time: response, feedback, result.
  std::shared_future<typename GoalHandle::SharedPtr> async_send_goal(
      const Goal& goal, const SendGoalOptions& options = {}) {
    auto promise = std::make_shared<std::promise<typename GoalHandle::SharedPtr>>();
    auto future = promise->get_future().share();
    // The handle is made when the server accepts the goal; `known` passes it to the other
    // callbacks.
    auto known = std::make_shared<takt::detail::Guarded<std::weak_ptr<GoalHandle>>>();
    auto waits = options.result_callback ? std::make_shared<Waits>() : nullptr;
    typename takt::ActionClient<A>::GoalCallbacks callbacks;
    callbacks.response = [promise, known, waits, response = options.goal_response_callback,
                          result = options.result_callback](
                             const std::shared_ptr<takt::ClientGoalHandle>& accepted) {
      typename GoalHandle::SharedPtr handle;
      if (accepted != nullptr) {
        handle = std::make_shared<GoalHandle>(accepted);
        *known->lock() = handle;
        if (waits != nullptr) {
          waits->handle = handle;
          handle->set_result_callback(result);
        }
      }
      promise->set_value(handle);
      std::exception_ptr failure;
      try {
        if (response) response(handle);
      } catch (...) {
        failure = std::current_exception();  // the goal goes on all the same
      }
      // Takt's client requests the result when this callback returns.
      if (handle != nullptr && waits != nullptr) handle->is_asked_.store(true);
      if (failure != nullptr) std::rethrow_exception(failure);
    };
    if (options.feedback_callback) {
      callbacks.feedback = [known, cells = cells_, callback = options.feedback_callback](
                               const std::shared_ptr<takt::ClientGoalHandle>&,
                               const typename A::Feedback& feedback) {
        if (auto handle = known->lock()->lock()) {
          callback(std::move(handle),
                   std::allocate_shared<typename A::Feedback>(cells->allocator(), feedback));
        }
      };
    }
    if (waits != nullptr) {
      callbacks.result = tells(waits);
      callbacks.result_came = ends(std::move(waits));
    }
    takt_->async_send_goal(goal, std::move(callbacks));
    return future;
  }
  std::shared_future<WrappedResult> async_get_result(typename GoalHandle::SharedPtr handle,
                                                     ResultCallback callback = nullptr) {
    check(handle);
    if (callback) handle->set_result_callback(std::move(callback));
    if (!handle->is_asked_.exchange(true)) {  // else only the callback was replaced
      auto waits = std::make_shared<Waits>();
      waits->handle = handle;
      takt_->async_get_result(handle->takt_, tells(waits), ends(waits));
    }
    return handle->future_;
  }
  std::shared_future<typename CancelResponse::SharedPtr> async_cancel_goal(
      typename GoalHandle::SharedPtr handle, CancelCallback callback = nullptr) {
    check(handle);
    return cancelled(std::move(callback), [&](auto answer) {
      takt_->async_cancel_goal(handle->takt_, std::move(answer));
    });
  }
  std::shared_future<typename CancelResponse::SharedPtr> async_cancel_all_goals(
      CancelCallback callback = nullptr) {
    return cancelled(std::move(callback),
                     [&](auto answer) { takt_->async_cancel_all_goals(std::move(answer)); });
  }
  std::shared_future<typename CancelResponse::SharedPtr> async_cancel_goals_before(
      const rclcpp::Time& time, CancelCallback callback = nullptr) {
    return cancelled(std::move(callback), [&](auto answer) {
      takt_->async_cancel_goals_before(time, std::move(answer));
    });
  }
  RCLCPP_REFUSED_(stop_callbacks, "stop_callbacks")

 private:
  /// Owned by the callbacks of Takt's client. When these are dropped without a result, the
  /// destructor ends the goal handle.
  struct Waits {
    ~Waits() {
      if (handle != nullptr) handle->end(nullptr);
    }
    typename GoalHandle::SharedPtr handle;
  };

  using TaktResultCallback = typename takt::ActionClient<A>::ResultCallback;
  /// Completes the future as soon as the result arrives: the response callback may be waiting for
  /// it.
  static TaktResultCallback ends(std::shared_ptr<Waits> waits) {
    return [waits = std::move(waits)](const auto&, const takt::GoalResult<A>& result) {
      waits->handle->end(&result);
    };
  }
  static TaktResultCallback tells(std::shared_ptr<Waits> waits) {
    return [waits = std::move(waits)](const auto&, const auto&) { waits->handle->tell(); };
  }
  void check(const typename GoalHandle::SharedPtr& handle) const {
    if (handle == nullptr || !takt_->has_sent(*handle->takt_)) {
      throw exceptions::UnknownGoalHandleError();
    }
  }
  template <class F>
  std::shared_future<typename CancelResponse::SharedPtr> cancelled(CancelCallback callback,
                                                                   F&& send) {
    auto promise = std::make_shared<std::promise<typename CancelResponse::SharedPtr>>();
    auto future = promise->get_future().share();
    send([promise, callback = std::move(callback)](const CancelResponse& answer) {
      auto response = std::make_shared<CancelResponse>(answer);
      promise->set_value(response);
      if (callback) callback(std::move(response));
    });
    return future;
  }

  // Limit: messages of feedback that a client has set memory aside for. At it: further ones come
  // from the heap. Seen: `takt run --allocations`.
  static constexpr std::size_t kMostInCells = 16;
  const std::shared_ptr<const takt::Cells> cells_ =
      std::make_shared<takt::Cells>(kMostInCells, sizeof(typename A::Feedback) + 64);
  const std::shared_ptr<takt::ActionClient<A>> takt_;
};

template <class A, class N>
typename Client<A>::SharedPtr create_client(N&& node, const std::string& name,
                                            rclcpp::CallbackGroup::SharedPtr group = nullptr) {
  return std::make_shared<Client<A>>(rclcpp::detail::base_of(node), name, std::move(group));
}
template <class A, class Base, class Graph, class Logging, class Waitables>
typename Client<A>::SharedPtr create_client(std::shared_ptr<Base> base, Graph, Logging, Waitables,
                                            const std::string& name,
                                            rclcpp::CallbackGroup::SharedPtr group = nullptr) {
  return create_client<A>(std::move(base), name, std::move(group));
}

}  // namespace rclcpp_action

#endif  // RCLCPP_ACTION__CLIENT_HPP_
