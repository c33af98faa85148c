// Sends goals to an action server, without waiting.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_ACTION_CLIENT_HPP_
#define TAKT_ROS2_ACTION_CLIENT_HPP_

#include <algorithm>
#include <atomic>
#include <deque>
#include <exception>
#include <functional>
#include <iterator>
#include <memory>
#include <mutex>
#include <semaphore>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/user_function.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/node.hpp"
#include "takt/ros2/action.hpp"

namespace TAKT_PUBLIC takt {

namespace detail {

/// Runs the callbacks of one goal one at a time and in order, also in a reentrant group. One that
/// becomes due during another one runs after it, on the same thread.
/// Thread safety: every method from any thread.
/// Real-time: a lock with priority inheritance; a callback that has to wait allocates.
class GoalCalls {
 public:
  enum class Kind { feedback, result };

  /// The first callback begins; no other thread knows the goal yet.
  void begin() noexcept { is_busy_ = true; }
  /// A callback has ended, perhaps with an exception. Runs the callbacks that wait, then throws the
  /// first exception.
  void end(std::exception_ptr failure);
  /// Calls `now`. If another callback of the goal is running, keeps the function that `kept`
  /// returns, to be called after that callback.
  template <class Now, class Kept>
  void call(Kind kind, Now&& now, Kept&& kept) {
    if (waits(kind, kept)) return;
    std::exception_ptr failure;
    try {
      now();
    } catch (...) {
      failure = std::current_exception();
    }
    end(std::move(failure));
  }

 private:
  // Limit: feedback about a goal that waits until another callback of the goal has returned. At it:
  // the oldest is dropped, as in the queue before. Seen: nothing.
  static constexpr int kMostFeedback = 10;
  struct Waiting {
    Kind kind;
    std::function<void()> call;
  };
  bool waits(Kind kind, const std::function<std::function<void()>()>& kept);

  PiMutex mutex_;  // guards what follows
  bool is_busy_ = false;
  std::deque<Waiting> waiting_;
};

}  // namespace detail

/// A goal of one client that a server has accepted. `state` is the last one that the server
/// reported.
/// Thread safety: every method from any thread.
/// Real-time: nothing blocks or allocates after construction, except through GoalCalls.
class ClientGoalHandle {
 public:
  ClientGoalHandle(const GoalId& id, builtin_interfaces::msg::Time stamp,
                   std::weak_ptr<const void> client)
      : id_(id), stamp_(stamp), client_(std::move(client)) {}
  const GoalId& id() const noexcept { return id_; }
  const builtin_interfaces::msg::Time& stamp() const noexcept { return stamp_; }
  GoalState state() const noexcept { return state_.load(); }
  void set_state(GoalState state) noexcept { state_.store(state); }
  /// Identifies the client that sent the goal.
  const std::weak_ptr<const void>& client() const noexcept { return client_; }
  detail::GoalCalls& calls() noexcept { return calls_; }

 private:
  const GoalId id_;
  const builtin_interfaces::msg::Time stamp_;
  const std::weak_ptr<const void> client_;
  std::atomic<GoalState> state_{GoalState::accepted};
  detail::GoalCalls calls_;
};

/// Limits the number of goals that an action client waits for. The limit is checked when the user
/// calls: an error in a callback of the library would end the executor's spin.
/// Thread safety: every method from any thread.
/// Real-time: nothing blocks; take() allocates.
class ActionPlaces {
 public:
  /// The last owner frees the place.
  using Place = std::shared_ptr<void>;

  /// `what` is the noun of the error message: "goals".
  ActionPlaces(std::string action, std::string what, std::size_t count);
  /// Throws Error when all places are taken.
  Place take() const;

 private:
  const std::string action_, what_;
  const std::size_t count_;
  const std::shared_ptr<std::counting_semaphore<>> free_;  // lives as long as any place
};

/// How a goal has ended. `unknown`: its server has gone, or does not know it any more; `error` says
/// which of them.
template <ActionType A>
struct GoalResult {
  GoalState state = GoalState::unknown;
  typename A::Result result{};
  std::string error{};
};
/// Whether the list of states is short enough to be read; if not, logs why.
bool may_be_read(const action_msgs::msg::GoalStatusArray& states);
/// The error for a goal without a result. `has_answer`: the server says that it does not know the
/// goal.
std::string lost_result(const std::string& service, const GoalId& goal, bool has_answer);
/// Throws Error for nullptr, which stands for a goal that was not accepted, and for a goal of
/// another client.
const GoalId& id_of(const std::shared_ptr<ClientGoalHandle>& goal, const std::string& action,
                    const std::shared_ptr<const void>& client);

struct ActionClientOptions {
  /// How long a goal or a cancellation waits to be accepted; 0: for ever. A result may always take
  /// as long as it needs.
  Nanoseconds timeout{0};
  /// How long goals and requests stay pending once the client knows that there is no server. A
  /// server that comes back in time is asked again: if it was restarted, it does not know the goal,
  /// which ends then. Nanoseconds::max(): they wait for ever, as in ROS 2.
  Nanoseconds without_server = std::chrono::seconds(2);
  /// Maximum number of goals whose result the client waits for after async_send_goal(). Calls of
  /// result() and async_get_result() have the same limit, counted separately. The next call throws
  /// an Error.
  std::size_t most_goals = 10;
  /// The group of all parts of the client; nullptr: the default group.
  std::shared_ptr<CallbackGroup> group;
};

/// ROS 2's action client. Its parts are entities of the node: three clients, and the subscriptions
/// to feedback and status. Every call exists for coroutines, as a Task, and with callbacks, which
/// run in the callback group of the parts.
///
/// Thread safety: every method from any thread.
/// Real-time: as Client; each goal allocates.
template <ActionType A>
class ActionClient {
 public:
  using Handle = std::shared_ptr<ClientGoalHandle>;
  using Goal = typename A::Goal;
  using FeedbackCallback = std::function<void(const Handle&, const typename A::Feedback&)>;
  using ResultCallback = std::function<void(const Handle&, const GoalResult<A>&)>;
  using CancelResult = CancelGoal::Response;

  /// Any may be empty. They are called one at a time: the response, then feedback, then the result.
  struct GoalCallbacks {
    std::function<void(const Handle&)> response;  // nullptr: not accepted, or not in time
    FeedbackCallback feedback;
    ResultCallback result;
    ResultCallback result_came;  // on arrival, even during another one
  };

  ActionClient(Node& node, const std::string& name, const ActionClientOptions& options = {})
      : name_(name),
        goals_(std::make_shared<Goals>()),
        sent_(name, "goals", options.most_goals),
        asked_(name, "results", options.most_goals),
        feedback_(node.create_subscription<FeedbackMessage<A>>(
            name + kFeedback, QoS(10),
            [goals = goals_](const FeedbackMessage<A>& message) {
              const auto found = goals->find(message.goal_id);
              if (found.first != nullptr && *found.second) call(found, message.feedback);
            },
            options.group)),
        status_(node.create_subscription<action_msgs::msg::GoalStatusArray>(
            name + kStatus, status_qos(),
            [goals = goals_](const action_msgs::msg::GoalStatusArray& message) {
              if (may_be_read(message)) goals->set_states(message.status_list);
            },
            options.group)),
        send_(node.create_client<SendGoal<A>>(
            name + kSendGoal, {options.most_goals, options.timeout, options.without_server},
            options.group)),
        cancel_(node.create_client<CancelGoal>(
            name + kCancelGoal, {options.most_goals, options.timeout, options.without_server},
            options.group)),
        result_(node.create_client<GetResult<A>>(
            name + kGetResult,
            {.calls_in_flight = 2 * options.most_goals,
             .without_service = options.without_server,
             .repeats = options.without_server != Nanoseconds::max()},
            options.group)) {
    goals_->result_service = result_->service_name();
  }
  ActionClient(const ActionClient&) = delete;
  ActionClient& operator=(const ActionClient&) = delete;

  /// Whether this client sent the goal. The functions below throw Error for a goal of another
  /// client.
  bool has_sent(const ClientGoalHandle& goal) const noexcept {
    return !goal.client().owner_before(goals_) && !goals_.owner_before(goal.client());
  }
  /// Whether the three services of an action server are discovered.
  bool action_server_is_ready() const noexcept {
    return send_->service_is_ready() && cancel_->service_is_ready() && result_->service_is_ready();
  }

  // ---- For coroutines ----

  /// nullptr: the goal was not accepted, or not in time. `feedback` is called as a callback of its
  /// own.
  Task<Handle> send_goal(Goal goal, FeedbackCallback feedback = {}) {
    const std::shared_ptr<Goals> goals = goals_;  // the client may be gone after the call
    const typename SendGoal<A>::Request request{new_goal_id(), std::move(goal)};
    const auto answer = co_await send_->call(request);
    co_return answer && answer->accepted
        ? goals->add(request.goal_id, answer->stamp, std::move(feedback))
        : nullptr;
  }
  Task<GoalResult<A>> result(Handle goal) {
    const std::shared_ptr<Goals> goals = goals_;
    const Place place = asked_.take();
    const typename GetResult<A>::Request request{id_of(goal, name_, goals_)};
    const auto answer = co_await result_->call(request);
    co_return goals->end(*goal, answer ? &*answer : nullptr);
  }
  /// A response without goals: the server did not answer in time, or return_code says why.
  Task<CancelResult> cancel_goal(Handle goal) {
    const CancelGoal::Request request = cancel_request(id_of(goal, name_, goals_));
    const auto answer = co_await cancel_->call(request);
    co_return answer ? *answer : CancelResult{};
  }

  // ---- With callbacks ----

  void async_send_goal(const Goal& goal, GoalCallbacks callbacks = {}) {
    const GoalId id = new_goal_id();
    send_->async_send_request(
        {id, goal},
        [goals = goals_, results = std::weak_ptr(result_), id, place = sent_.take(),
         callbacks = std::move(callbacks)](const typename SendGoal<A>::Response* answer) mutable {
          const Handle handle = answer != nullptr && answer->accepted
                                    ? goals->add(id, answer->stamp, std::move(callbacks.feedback),
                                                 /*is_answering=*/true)
                                    : nullptr;
          const bool wants_result =
              handle != nullptr && (callbacks.result || callbacks.result_came);
          if (!wants_result) place.reset();  // the callback may send the next goal
          std::exception_ptr failure;
          try {
            if (callbacks.response) callbacks.response(handle);
          } catch (...) {
            failure = std::current_exception();  // the goal goes on all the same
          }
          // The callback may have dropped the action client.
          if (const auto client = wants_result ? results.lock() : nullptr) {
            ask_result(*client, goals, handle, std::move(place), std::move(callbacks.result),
                       std::move(callbacks.result_came));
          }
          if (handle != nullptr) {
            handle->calls().end(std::move(failure));
          } else if (failure) {
            std::rethrow_exception(failure);
          }
        });
  }
  /// The callbacks are as in GoalCallbacks.
  void async_get_result(Handle goal, ResultCallback result, ResultCallback result_came = {}) {
    id_of(goal, name_, goals_);
    ask_result(*result_, goals_, std::move(goal), asked_.take(), std::move(result),
               std::move(result_came));
  }
  void async_cancel_goal(const Handle& goal, std::function<void(const CancelResult&)> callback) {
    cancel(cancel_request(id_of(goal, name_, goals_)), std::move(callback));
  }
  /// Cancels the goals of all clients.
  void async_cancel_all_goals(std::function<void(const CancelResult&)> callback) {
    cancel({}, std::move(callback));
  }
  /// Those that the server has accepted by this time of its clock.
  void async_cancel_goals_before(builtin_interfaces::msg::Time time,
                                 std::function<void(const CancelResult&)> callback) {
    CancelGoal::Request request;
    request.goal_info.stamp = time;
    cancel(request, std::move(callback));
  }

 private:
  using Place = ActionPlaces::Place;
  /// Shared, so that a call does not copy the user's function.
  using Feedback =
      std::shared_ptr<const detail::UserFunction<void(const Handle&, const typename A::Feedback&)>>;

  /// Accepted goals without a result so far.
  class Goals : public std::enable_shared_from_this<Goals> {
   public:
    std::string result_service;  // set before the first goal
    Handle add(const GoalId& id, builtin_interfaces::msg::Time stamp, FeedbackCallback feedback,
               bool is_answering = false) {
      auto handle = std::make_shared<ClientGoalHandle>(id, stamp, this->weak_from_this());
      if (is_answering) handle->calls().begin();
      Entry added{id, handle,
                  std::make_shared<typename Feedback::element_type>(std::move(feedback))};
      std::vector<Entry> gone;
      const std::lock_guard lock(mutex_);
      gone = take_out([](const Entry& entry) { return entry.handle.expired(); });
      goals_.push_back(std::move(added));
      for (const auto& status : last_) apply(status);  // states that came before the response
      return handle;
    }
    void set_states(const std::vector<action_msgs::msg::GoalStatus>& statuses) {
      const std::lock_guard lock(mutex_);
      last_ = statuses;
      for (const auto& status : last_) apply(status);
    }
    /// `answer`: nullptr if no server can give one.
    GoalResult<A> end(ClientGoalHandle& goal, const typename GetResult<A>::Response* answer) {
      {
        std::vector<Entry> gone;
        const std::lock_guard lock(mutex_);
        gone = take_out([&](const Entry& entry) { return entry.id == goal.id(); });
      }
      GoalResult<A> result;
      if (answer != nullptr) {
        result.state = static_cast<GoalState>(answer->status);
        result.result = answer->result;
      }
      if (result.state == GoalState::unknown) {
        result.error = lost_result(result_service, goal.id(), answer != nullptr);
      }
      goal.set_state(result.state);
      return result;
    }
    std::pair<Handle, Feedback> find(const GoalId& id) {
      const std::lock_guard lock(mutex_);
      for (const Entry& entry : goals_) {
        if (entry.id == id) return {entry.handle.lock(), entry.feedback};
      }
      return {};
    }

   private:
    struct Entry {
      GoalId id;
      std::weak_ptr<ClientGoalHandle> handle;
      Feedback feedback;
    };
    // The caller destroys these after the unlock: a user's function may own an object whose
    // destructor waits for this lock.
    template <class Condition>
    std::vector<Entry> take_out(Condition&& is_out) {
      const auto first = std::stable_partition(goals_.begin(), goals_.end(),
                                               [&](const Entry& entry) { return !is_out(entry); });
      std::vector<Entry> out(std::make_move_iterator(first), std::make_move_iterator(goals_.end()));
      goals_.erase(first, goals_.end());
      return out;
    }
    void apply(const action_msgs::msg::GoalStatus& status) noexcept {
      for (const Entry& entry : goals_) {
        const Handle handle = entry.id == status.goal_info.goal_id ? entry.handle.lock() : nullptr;
        if (handle != nullptr) handle->set_state(static_cast<GoalState>(status.status));
      }
    }
    PiMutex mutex_;
    std::vector<Entry> goals_;
    std::vector<action_msgs::msg::GoalStatus> last_;  // of all goals of the server
  };

  static void call(const std::pair<Handle, Feedback>& goal, const typename A::Feedback& feedback) {
    goal.first->calls().call(
        detail::GoalCalls::Kind::feedback, [&] { (*goal.second)(goal.first, feedback); },
        [&] { return [goal, feedback] { (*goal.second)(goal.first, feedback); }; });
  }
  static void ask_result(Client<GetResult<A>>& client, const std::shared_ptr<Goals>& goals,
                         Handle goal, Place place, ResultCallback callback, ResultCallback came) {
    const GoalId id = goal->id();
    client.async_send_request({id}, [goals, goal = std::move(goal), place = std::move(place),
                                     callback = std::move(callback), came = std::move(came)](
                                        const typename GetResult<A>::Response* answer) mutable {
      const GoalResult<A> result = goals->end(*goal, answer);
      place.reset();  // the callback may send the next goal
      if (came) came(goal, result);
      if (!callback) return;
      goal->calls().call(
          detail::GoalCalls::Kind::result, [&] { callback(goal, result); },
          [&] { return [callback, goal, result] { callback(goal, result); }; });
    });
  }

  static CancelGoal::Request cancel_request(const GoalId& id) {
    CancelGoal::Request request;
    request.goal_info.goal_id = id;
    return request;
  }
  void cancel(const CancelGoal::Request& request,
              std::function<void(const CancelResult&)> callback) {
    cancel_->async_send_request(request,
                                [callback = std::move(callback)](const CancelResult* answer) {
                                  if (callback)
                                    callback(answer != nullptr ? *answer : CancelResult{});
                                });
  }

  const std::string name_;
  const std::shared_ptr<Goals> goals_;
  const ActionPlaces sent_, asked_;
  // Declared in this order, so that an executor that serves in order of registration takes feedback
  // before the result.
  const std::shared_ptr<Subscription<FeedbackMessage<A>>> feedback_;
  const std::shared_ptr<Subscription<action_msgs::msg::GoalStatusArray>> status_;
  const std::shared_ptr<Client<SendGoal<A>>> send_;
  const std::shared_ptr<Client<CancelGoal>> cancel_;
  const std::shared_ptr<Client<GetResult<A>>> result_;
};

/// See ActionClient.
template <ActionType A>
[[nodiscard]] std::shared_ptr<ActionClient<A>> create_action_client(
    Node& node, const std::string& name, const ActionClientOptions& options = {}) {
  return std::make_shared<ActionClient<A>>(node, name, options);
}

}  // namespace takt

#endif  // TAKT_ROS2_ACTION_CLIENT_HPP_
