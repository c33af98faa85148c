// ActionServer: executes goals of clients, and sends them feedback and results.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_ACTION_SERVER_HPP_
#define TAKT_ROS2_ACTION_SERVER_HPP_

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/node.hpp"
#include "takt/ros2/action.hpp"
#include "takt/ros2/action_server_core.hpp"

namespace TAKT_PUBLIC takt {

/// Accepts goals, and executes them; ROS 2's action server. Its parts are entities of the node,
/// each in the group that the options give it: the services "NAME/_action/send_goal",
/// "…/cancel_goal" and "…/get_result", and the guard condition "NAME_execute", which calls
/// handle_accepted.
///
/// - `handle_goal` accepts or rejects a goal, and returns at once. A goal that it defers is still
///   given to handle_accepted, and is not executed before ServerGoalHandle::execute.
/// - `handle_cancel` accepts or rejects a request for cancellation; if it accepts, the goal's
///   is_canceling() becomes true.
/// - `handle_accepted` executes the goal. It may be a coroutine, `[](auto goal) -> Task<> {...}`,
///   of which at most `most_goals` run; or it keeps the handle, and returns. A coroutine that goes
///   on after the end of its goal does not count as a goal any more, but the next goal may have to
///   wait until that coroutine ends.
///
/// A handler that throws gives a negative answer: the goal is rejected, not canceled, or aborted.
/// The executor then handles the exception like one of any callback.
///
/// Thread safety: any. Dropping the server ends its parts, and aborts the goals that are left.
/// Real-time: no; goals are kept in memory that is allocated when they come.
template <ActionType A>
class ActionServer {
 public:
  using Handle = ServerGoalHandle<A>;

  template <class HandleGoal, class HandleCancel, class HandleAccepted>
  ActionServer(Node& node, const std::string& name, HandleGoal handle_goal,
               HandleCancel handle_cancel, HandleAccepted handle_accepted,
               const ActionServerOptions& options)
      : core_(std::make_shared<ActionServerCore<A>>(name, options)) {
    core_->set_publishers(
        node.create_publisher<FeedbackMessage<A>>(name + kFeedback, QoS(10)),
        node.create_publisher<action_msgs::msg::GoalStatusArray>(name + kStatus, status_qos()));
    std::string base(name.substr(name.find_first_not_of("~/")));
    std::replace(base.begin(), base.end(), '/', '_');
    make_execution(node, base, std::move(handle_accepted), options);
    make_result_service(node, name, options.result_group);
    make_cancel_service(node, name, std::move(handle_cancel), options.cancel_group);
    make_goal_service(node, name, std::move(handle_goal), options.goal_group);
    expiry_ = node.create_timer(
        base + "_expiry", std::chrono::hours(1), [core = core_] { core->expire(); },
        options.result_group, /*autostart=*/false);
    core_->set_expiry(expiry_);
  }
  ~ActionServer() {
    accepted_->set_listener(nullptr);
    core_->close();
  }
  ActionServer(const ActionServer&) = delete;
  ActionServer& operator=(const ActionServer&) = delete;

 private:
  template <class HandleAccepted>
  void make_execution(Node& node, const std::string& base, HandleAccepted handle_accepted,
                      const ActionServerOptions& options) {
    constexpr bool kIsTask = TaskCallback<HandleAccepted, std::shared_ptr<Handle>>;
    auto execute_group = options.execute_group;
    if (execute_group == nullptr) execute_group = node.default_callback_group();
    if constexpr (kIsTask) {
      runner_ = node.create_task_runner(base + "_execute", execute_group, options.most_goals);
    }
    execute_ = node.create_guard_condition(
        base + "_execute",
        [core = core_, accepted = accepted_, weak = std::weak_ptr(runner_),
         callback = std::make_shared<HandleAccepted>(std::move(handle_accepted))] {
          const auto runner = weak.lock();  // the callback may drop the server
          // Without a free task the goal waits: the end of a coroutine triggers this callback
          // again.
          if (kIsTask && (runner == nullptr || !runner->reserve())) return;
          auto [goal, is_executed] = accepted->pop();
          if (goal == nullptr) {
            if (kIsTask) runner->give_back();
            return;
          }
          if (is_executed) core->begin(goal->id());
          if constexpr (kIsTask) {
            runner->start([&, &goal = goal] { return execute(callback, std::move(goal)); });
          } else {
            (*callback)(std::move(goal));
          }
        },
        execute_group);
    accepted_->set_listener(execute_.get());
    if constexpr (kIsTask) runner_->set_owner_of_tasks(*accepted_);
  }
  template <class HandleCancel>
  void make_cancel_service(Node& node, const std::string& name, HandleCancel handle_cancel,
                           const std::shared_ptr<CallbackGroup>& group) {
    cancel_ = node.create_service<CancelGoal>(
        name + kCancelGoal,
        [core = core_, handle_cancel = std::move(handle_cancel)](
            const auto& request, auto& response) mutable -> std::exception_ptr {
          std::exception_ptr failure;
          const auto may = [&](const auto& goal) {
            try {
              return handle_cancel(goal);
            } catch (...) {
              failure = std::current_exception();
              return CancelResponse::reject;
            }
          };
          response = core->cancel(request.goal_info, may);
          return failure;
        },
        group, rare_service());
  }
  template <class HandleGoal>
  void make_goal_service(Node& node, const std::string& name, HandleGoal handle_goal,
                         const std::shared_ptr<CallbackGroup>& group) {
    goal_ = node.create_service<SendGoal<A>>(
        name + kSendGoal,
        [stamps = stamps_of(node), core = core_, accepted = accepted_,
         handle_goal = std::move(handle_goal)](const auto& request,
                                               auto& response) mutable -> std::exception_ptr {
          GoalResponse decision = GoalResponse::reject;
          try {
            decision = handle_goal(request.goal_id, request.goal);
          } catch (...) {
            return std::current_exception();
          }
          if (decision == GoalResponse::reject) return nullptr;
          response.stamp = stamps();
          auto goal = core->accept(request.goal_id, request.goal, response.stamp);
          if (goal == nullptr) return nullptr;
          response.accepted = true;
          accepted->push({std::move(goal), decision == GoalResponse::accept_and_execute});
          return nullptr;
        },
        group, rare_service());
  }
  void make_result_service(Node& node, const std::string& name,
                           const std::shared_ptr<CallbackGroup>& group) {
    result_ = node.create_service<GetResult<A>>(
        name + kGetResult,
        [core = core_](const auto& request, RequestId id) {
          core->ask_result(request.goal_id, id);
        },
        group, rare_service());
    core_->set_result_service(result_);
  }

  /// The queue of accepted goals for handle_accepted; no more than most_goals. One goal is popped
  /// for each call, as the callback may throw, or drop the server.
  class Accepted : public TaskOwner {
   public:
    /// The guard condition that calls handle_accepted; nullptr: the server is being dropped.
    void set_listener(GuardCondition* listener) {
      const std::lock_guard lock(mutex_);
      listener_ = listener;
    }
    struct Next {
      std::shared_ptr<Handle> goal;  // nullptr: none
      bool is_executed = false;      // at once, not deferred
    };
    void push(Next goal) {
      const std::lock_guard lock(mutex_);
      goals_.push_back(std::move(goal));
      trigger();
    }
    Next pop() {
      Next first;
      const std::lock_guard lock(mutex_);
      if (goals_.empty()) return first;
      first = std::move(goals_.front());
      goals_.erase(goals_.begin());
      trigger();
      return first;
    }
    void task_ended() noexcept override {
      const std::lock_guard lock(mutex_);
      trigger();
    }

   private:
    void trigger() noexcept {
      if (listener_ != nullptr && !goals_.empty()) listener_->trigger();
    }

    RankedMutex<LockRank::accepted_goals> mutex_;  // guards all below
    GuardCondition* listener_ = nullptr;
    std::vector<Next> goals_;
  };

  // The coroutine owns the callback, as the server may be dropped meanwhile.
  template <class F>
  static Task<> execute(std::shared_ptr<F> callback, std::shared_ptr<Handle> goal) {
    co_await (*callback)(std::move(goal));
  }

  const std::shared_ptr<ActionServerCore<A>> core_;
  const std::shared_ptr<Accepted> accepted_ = std::make_shared<Accepted>();
  std::shared_ptr<TaskRunner> runner_;  // must be destroyed before accepted_
  std::shared_ptr<GuardCondition> execute_;
  std::shared_ptr<Service<GetResult<A>>> result_;
  std::shared_ptr<Service<CancelGoal>> cancel_;
  std::shared_ptr<Service<SendGoal<A>>> goal_;
  std::shared_ptr<Timer> expiry_;
};

/// `handle_goal(const GoalId&, const A::Goal&)` → GoalResponse, `handle_cancel(const
/// std::shared_ptr<ServerGoalHandle<A>>&)` → CancelResponse, and
/// `handle_accepted(std::shared_ptr<ServerGoalHandle<A>>)`, perhaps a coroutine: see ActionServer.
template <ActionType A, class HandleGoal, class HandleCancel, class HandleAccepted>
[[nodiscard]] std::shared_ptr<ActionServer<A>> create_action_server(
    Node& node, const std::string& name, HandleGoal handle_goal, HandleCancel handle_cancel,
    HandleAccepted handle_accepted, const ActionServerOptions& options = {}) {
  return std::make_shared<ActionServer<A>>(node, name, std::move(handle_goal),
                                           std::move(handle_cancel), std::move(handle_accepted),
                                           options);
}

}  // namespace takt

#endif  // TAKT_ROS2_ACTION_SERVER_HPP_
