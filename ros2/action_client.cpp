// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/action_client.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/same_owner.hpp"
#include "takt/messages/entries.hpp"

namespace takt {
namespace detail {

// `dropped` is destroyed after the unlock, as it owns functions of the user.
bool GoalCalls::waits(Kind kind, const std::function<std::function<void()>()>& kept) {
  Waiting dropped;
  const std::lock_guard lock(mutex_);
  if (!std::exchange(is_busy_, true)) return false;
  const auto is_feedback = [](const Waiting& each) { return each.kind == Kind::feedback; };
  if (kind == Kind::feedback &&
      std::count_if(waiting_.begin(), waiting_.end(), is_feedback) >= kMostFeedback) {
    const auto oldest = std::find_if(waiting_.begin(), waiting_.end(), is_feedback);
    dropped = std::move(*oldest);
    waiting_.erase(oldest);
  }
  waiting_.push_back({kind, kept()});
  return true;
}

void GoalCalls::end(std::exception_ptr failure) {
  for (;;) {
    Waiting next;
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.empty()) {
        is_busy_ = false;
        break;
      }
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    try {
      next.call();
    } catch (...) {
      if (failure == nullptr) failure = std::current_exception();
    }
  }
  if (failure != nullptr) std::rethrow_exception(failure);
}

}  // namespace detail

ActionPlaces::ActionPlaces(std::string action, std::string what, std::size_t count)
    : action_(std::move(action)),
      what_(std::move(what)),
      count_(count),
      free_(std::make_shared<std::counting_semaphore<>>(static_cast<std::ptrdiff_t>(count))) {
}

ActionPlaces::Place ActionPlaces::take() const {
  if (!free_->try_acquire()) {
    throw Error(fmt::format("action '{}': {} {} are awaited already", action_, count_, what_),
                "wait for some, or raise ActionClientOptions::most_goals");
  }
  return {nullptr, [free = free_](void*) { free->release(); }};
}

std::string lost_result(const std::string& service, const GoalId& goal, bool has_answer) {
  if (has_answer) {
    return fmt::format(
        "'{}' does not know goal {}: its server has been restarted, or has forgotten the result",
        service, to_string(goal));
  }
  return fmt::format("no answer from '{}' about goal {}: its server has gone, or this client",
                     service, to_string(goal));
}

bool may_be_read(const action_msgs::msg::GoalStatusArray& states) {
  const std::string why = why_too_long(states);
  if (why.empty()) return true;
  static constinit LogThrottle throttle(1);
  if (throttle.may_log()) log(LogLevel::warn, "the states of an action's goals: {}", why);
  return false;
}

const GoalId& id_of(const std::shared_ptr<ClientGoalHandle>& goal, const std::string& action,
                    const std::shared_ptr<const void>& client) {
  if (goal == nullptr) {
    throw Error("a result or a cancellation is asked of a goal that was not accepted (nullptr)",
                "look whether send_goal() gave a goal before you ask for it");
  }
  if (!is_same_owner(goal->client(), client)) {
    throw Error(
        fmt::format("goal {} is none of this client of action '{}'", to_string(goal->id()), action),
        "ask the client that has sent it");
  }
  return goal->id();
}

}  // namespace takt
