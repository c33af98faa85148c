// The goals of an action server, and the handle with which a program executes a goal.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_ACTION_SERVER_CORE_HPP_
#define TAKT_ROS2_ACTION_SERVER_CORE_HPP_

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/ros_time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/node.hpp"
#include "takt/ros2/action.hpp"

namespace TAKT_PUBLIC takt {

/// A goal that is deferred stays accepted until ServerGoalHandle::execute.
enum class GoalResponse { reject, accept_and_execute, accept_and_defer };
enum class CancelResponse { reject, accept };

struct ActionServerOptions {
  /// How many goals may be under way at once; one more is rejected.
  std::size_t most_goals = 10;
  /// How long the result of a goal that has ended can be asked for.
  Nanoseconds result_timeout = std::chrono::seconds(10);
  /// How many results the server keeps for that time. At the limit it rejects new goals, so that no
  /// result gets lost.
  std::size_t most_results = 1000;
  /// Each part is an entity in a group of its own choice; nullptr: the default group.
  std::shared_ptr<CallbackGroup> goal_group, cancel_group, result_group;
  std::shared_ptr<CallbackGroup> execute_group;  // of handle_accepted
};

template <ActionType A>
class ActionServerCore;

/// A goal, for the code that executes it. If the last pointer to it is dropped before the goal has
/// ended, the goal is aborted.
/// Thread safety: every method from any thread.
/// Real-time: a lock with priority inheritance; otherwise as Publisher::publish. succeed(), abort()
/// and canceled() copy the result.
template <ActionType A>
class ServerGoalHandle {
 public:
  ServerGoalHandle(std::shared_ptr<ActionServerCore<A>> core, const GoalId& id,
                   typename A::Goal goal)
      : core_(std::move(core)), id_(id), goal_(std::move(goal)) {}
  ~ServerGoalHandle() { core_->abandon(id_); }
  ServerGoalHandle(const ServerGoalHandle&) = delete;
  ServerGoalHandle& operator=(const ServerGoalHandle&) = delete;

  const GoalId& id() const noexcept { return id_; }
  const typename A::Goal& goal() const noexcept { return goal_; }
  GoalState state() const noexcept { return core_->state(id_); }
  /// Whether the cancellation of the goal was requested and accepted; end the goal with canceled().
  bool is_canceling() const noexcept { return state() == GoalState::canceling; }
  bool is_active() const noexcept {
    const GoalState now = state();
    return now != GoalState::unknown && !is_terminal(now);
  }

  void publish_feedback(const typename A::Feedback& feedback) {
    core_->publish_feedback(id_, feedback);
  }
  /// Begins the execution of a deferred goal. Throws Error when the goal is in another state than
  /// accepted.
  void execute() { core_->execute(id_); }
  // These throw Error unless the goal is executing or canceling; canceled() needs a goal that is
  // canceling. After the server was dropped, which aborts the goal, they do nothing.
  void succeed(const typename A::Result& result) { core_->end(id_, GoalState::succeeded, result); }
  void abort(const typename A::Result& result) { core_->end(id_, GoalState::aborted, result); }
  void canceled(const typename A::Result& result) { core_->end(id_, GoalState::canceled, result); }

 private:
  const std::shared_ptr<ActionServerCore<A>> core_;
  const GoalId id_;
  const typename A::Goal goal_;
};

/// The state that the server and its goals share.
/// Thread safety: every method from any thread.
/// Real-time: a lock with priority inheritance; a new goal and a result allocate.
template <ActionType A>
class ActionServerCore : public std::enable_shared_from_this<ActionServerCore<A>> {
 public:
  using Handle = ServerGoalHandle<A>;
  using ResultService = Service<GetResult<A>>;
  using Result = typename GetResult<A>::Response;

  explicit ActionServerCore(std::string name, const ActionServerOptions& options)
      : name_(std::move(name)), options_(options) {
    goals_.reserve(options.most_goals);
  }

  void set_publishers(std::shared_ptr<Publisher<FeedbackMessage<A>>> feedback,
                      std::shared_ptr<Publisher<action_msgs::msg::GoalStatusArray>> status) {
    const std::lock_guard lock(mutex_);
    feedback_ = std::move(feedback);
    status_ = std::move(status);
  }
  void set_result_service(std::weak_ptr<ResultService> service) {
    const std::lock_guard lock(mutex_);
    result_service_ = std::move(service);
  }
  /// `timer` calls expire(); it is still cancelled.
  void set_expiry(const std::shared_ptr<Timer>& timer) {
    const std::lock_guard lock(mutex_);
    expiry_ = timer;
  }
  /// The server is being dropped: aborts its goals, and sends that result to the clients that wait
  /// for one. Nothing is accepted, published or answered any more. From now on no thread gets a
  /// pointer to the parts, so that none of them is destroyed with the mutex held.
  void close() noexcept {
    decltype(feedback_) feedback;  // destroyed after the unlock
    decltype(status_) status;
    std::shared_ptr<ResultService> service;
    std::vector<RequestId> asking;
    {
      const std::lock_guard lock(mutex_);
      for (Goal& goal : goals_) {
        if (is_terminal(goal.state)) continue;
        goal.state = GoalState::aborted;
        asking.insert(asking.end(), goal.asking.begin(), goal.asking.end());
      }
      publish_status();
      feedback_.swap(feedback);
      status_.swap(status);
      service = result_service_.lock();
      result_service_.reset();
      expiry_.reset();
    }
    if (service == nullptr) return;
    const Result aborted{static_cast<std::int8_t>(GoalState::aborted), {}};
    for (const RequestId request : asking) service->send_response(request, aborted);
  }

  /// nullptr: the goal is known already, there is no room, or the server has gone.
  std::shared_ptr<Handle> accept(const GoalId& id, const typename A::Goal& goal,
                                 builtin_interfaces::msg::Time stamp) {
    const std::lock_guard lock(mutex_);
    if (status_ == nullptr || find(id) != nullptr || !has_room()) return nullptr;
    auto handle = std::make_shared<Handle>(this->shared_from_this(), id, goal);
    goals_.push_back({.info = action_msgs::msg::GoalInfo().set__goal_id(id).set__stamp(stamp),
                      .state = GoalState::accepted,
                      .handle = handle});
    publish_status();
    return handle;
  }

  /// Begins the execution; false: the goal is in another state than accepted.
  bool begin(const GoalId& id) {
    const std::lock_guard lock(mutex_);
    if (status_ == nullptr) return true;  // the server has gone, and the goal with it
    Goal* goal = find(id);
    if (goal == nullptr || goal->state != GoalState::accepted) return false;
    goal->state = GoalState::executing;
    publish_status();
    return true;
  }
  void execute(const GoalId& id) {
    if (begin(id)) return;
    throw Error(fmt::format("goal {} of action '{}' is {} and cannot be executed", to_string(id),
                            name_, to_string(state(id))),
                "execute a goal once, after accept_and_defer");
  }

  GoalState state(const GoalId& id) noexcept {
    const std::lock_guard lock(mutex_);
    const Goal* goal = find(id);
    return goal != nullptr ? goal->state : GoalState::unknown;
  }

  void publish_feedback(const GoalId& id, const typename A::Feedback& feedback) {
    // Without the lock: publishing may replace a message in a queue, and so destroy an object of
    // the user's type.
    if (const auto publisher = feedback_publisher()) {
      if (auto message = publisher->place_for_copy()) {
        message->goal_id = id;
        message->feedback = feedback;
        publisher->publish(std::move(message));
      } else {
        publisher->publish(FeedbackMessage<A>{id, feedback});
      }
    }
  }

  void end(const GoalId& id, GoalState state, const typename A::Result& result) {
    std::unique_lock lock(mutex_);
    if (status_ == nullptr) return;  // the server has gone, and the goal with it
    Goal* goal = find(id);
    const GoalState now = goal != nullptr ? goal->state : GoalState::unknown;
    const bool fits = now == GoalState::canceling ||
                      (now == GoalState::executing && state != GoalState::canceled);
    if (!fits) {
      throw Error(fmt::format("goal {} of action '{}' is {} and cannot become {}", to_string(id),
                              name_, to_string(now), to_string(state)),
                  "end a goal once, after its execution has begun; as canceled only when "
                  "is_canceling()");
    }
    finish(*goal, state, result, lock);
  }
  void abandon(const GoalId& id) noexcept {
    std::unique_lock lock(mutex_);
    Goal* goal = find(id);
    if (goal == nullptr || is_terminal(goal->state)) return;
    log(LogLevel::warn, "action '{}': nobody has ended goal {}: aborted", name_, to_string(id));
    finish(*goal, GoalState::aborted, {}, lock);
  }

  /// Answers a request for a result, or keeps the request until there is a result.
  void ask_result(const GoalId& id, RequestId request) {
    std::unique_lock lock(mutex_);
    Goal* goal = find(id);
    if (goal != nullptr && !is_terminal(goal->state)) {
      if (std::find(goal->asking.begin(), goal->asking.end(), request) != goal->asking.end()) {
        return;  // a client asks again when a server comes or goes
      }
      if (goal->asking.size() == kMostAsking) goal->asking.erase(goal->asking.begin());
      goal->asking.push_back(request);
    } else {
      answer({request}, goal != nullptr ? goal->response : Result{}, lock);
    }
  }

  /// Cancels the goals that a request names: with neither id nor stamp all; with a stamp those
  /// accepted until then, and with an id that one too. `may` calls the user's handler, without the
  /// lock.
  template <class May>
  CancelGoal::Response cancel(const action_msgs::msg::GoalInfo& wanted, May&& may) {
    const bool has_id = wanted.goal_id != GoalId{};
    const Time until = wanted.stamp;
    const bool has_stamp = until != Time();
    std::vector<std::shared_ptr<Handle>> asked;
    CancelGoal::Response response;
    {
      const std::lock_guard lock(mutex_);
      if (const Goal* goal = find(wanted.goal_id); has_id && !has_stamp) {
        if (goal == nullptr) {
          response.return_code = CancelGoal::Response::ERROR_UNKNOWN_GOAL_ID;
        } else if (is_terminal(goal->state)) {
          response.return_code = CancelGoal::Response::ERROR_GOAL_TERMINATED;
        }
      }
      for (const Goal& goal : goals_) {
        const bool is_meant = (!has_id && !has_stamp) ||
                              (has_id && goal.info.goal_id == wanted.goal_id) ||
                              (has_stamp && goal.info.stamp <= until);
        if (!is_meant || is_terminal(goal.state)) continue;
        // This pointer may be the last one. Dropping it under the mutex would deadlock in
        // abandon().
        if (auto handle = goal.handle.lock()) asked.push_back(std::move(handle));
      }
    }
    for (const auto& handle : asked) {
      if (may(handle) == CancelResponse::reject) continue;
      const std::lock_guard lock(mutex_);
      Goal* goal = find(handle->id());
      if (goal == nullptr || is_terminal(goal->state)) continue;
      goal->state = GoalState::canceling;
      response.goals_canceling.push_back(goal->info);
    }
    if (response.goals_canceling.empty() &&
        response.return_code == CancelGoal::Response::ERROR_NONE) {
      response.return_code = CancelGoal::Response::ERROR_REJECTED;
    }
    const std::lock_guard lock(mutex_);
    if (!response.goals_canceling.empty()) publish_status();
    return response;
  }

  /// Forgets goals that ended too long ago.
  void expire() noexcept {
    std::shared_ptr<Timer> timer;  // destroyed after the unlock
    std::vector<Goal> gone;
    const std::lock_guard lock(mutex_);
    timer = expiry_.lock();
    if (timer == nullptr) return;
    const TimePoint now = timer->clock().now();
    const auto first = std::stable_partition(goals_.begin(), goals_.end(), [&](const Goal& goal) {
      return !is_terminal(goal.state) || now < later(goal.ended, options_.result_timeout);
    });
    gone.assign(std::make_move_iterator(first), std::make_move_iterator(goals_.end()));
    goals_.erase(first, goals_.end());
    TimePoint next = kNever;
    for (const Goal& goal : goals_) {
      if (is_terminal(goal.state))
        next = std::min(next, later(goal.ended, options_.result_timeout));
    }
    timer->release_at(next);
    publish_status();
  }

 private:
  using Mutex = RankedMutex<LockRank::action_server>;
  // Clients that ask for the same result; more push out the oldest.
  // Limit: clients that ask for the result of the same goal. At it: the oldest one gets no answer.
  // Seen: nothing.
  static constexpr std::size_t kMostAsking = 16;
  struct Goal {
    action_msgs::msg::GoalInfo info;
    GoalState state = GoalState::unknown;
    std::weak_ptr<Handle> handle;
    Result response{};
    std::vector<RequestId> asking;
    TimePoint ended{};
  };

  std::shared_ptr<Publisher<FeedbackMessage<A>>> feedback_publisher() noexcept {
    const std::lock_guard lock(mutex_);
    return feedback_;
  }

  // Call with the mutex held: this and all functions below.
  Goal* find(const GoalId& id) noexcept {
    const auto goal = std::find_if(goals_.begin(), goals_.end(),
                                   [&](const Goal& known) { return known.info.goal_id == id; });
    return goal != goals_.end() ? &*goal : nullptr;
  }
  bool has_room() const noexcept {
    const auto ended = static_cast<std::size_t>(std::count_if(
        goals_.begin(), goals_.end(), [](const Goal& goal) { return is_terminal(goal.state); }));
    return goals_.size() - ended < options_.most_goals && ended < options_.most_results;
  }
  void finish(Goal& goal, GoalState state, const typename A::Result& result,
              std::unique_lock<Mutex>& lock) {
    goal.state = state;
    goal.response = {static_cast<std::int8_t>(state), result};
    publish_status();
    if (const auto timer = expiry_.lock()) {
      goal.ended = timer->clock().now();
      if (timer->is_canceled()) timer->release_at(later(goal.ended, options_.result_timeout));
    }
    answer(std::exchange(goal.asking, {}), goal.response, lock);
  }
  // Answers without the lock: it may take a while until the endpoint of a client is discovered.
  void answer(const std::vector<RequestId>& requests, const Result& of,
              std::unique_lock<Mutex>& lock) {
    const Result response = of;
    const auto service = result_service_.lock();
    lock.unlock();
    if (service == nullptr) return;
    for (const RequestId request : requests) service->send_response(request, response);
  }
  void publish_status() {
    if (status_ == nullptr) return;
    action_msgs::msg::GoalStatusArray message;
    for (const Goal& goal : goals_) {
      message.status_list.push_back(
          action_msgs::msg::GoalStatus().set__goal_info(goal.info).set__status(
              static_cast<std::int8_t>(goal.state)));
    }
    status_->publish(message);
  }

  const std::string name_;
  const ActionServerOptions options_;
  Mutex mutex_;  // guards all below
  std::vector<Goal> goals_;
  std::shared_ptr<Publisher<FeedbackMessage<A>>> feedback_;
  std::shared_ptr<Publisher<action_msgs::msg::GoalStatusArray>> status_;
  std::weak_ptr<ResultService> result_service_;
  std::weak_ptr<Timer> expiry_;
};

}  // namespace takt

#endif  // TAKT_ROS2_ACTION_SERVER_CORE_HPP_
