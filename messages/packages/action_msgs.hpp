// What all actions of ROS 2 share, as it is on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_ACTION_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_ACTION_MSGS_HPP_

#include <cstdint>
#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/builtin_interfaces.hpp"
#include "takt/messages/packages/unique_identifier_msgs.hpp"

namespace takt::action_msgs {

struct GoalInfo {
  unique_identifier_msgs::UUID goal_id;
  builtin_interfaces::Time stamp;
};
TAKT_MESSAGE(GoalInfo, "action_msgs/msg/GoalInfo", goal_id, stamp);

enum class GoalState : std::int8_t {
  unknown = 0,
  accepted = 1,
  executing = 2,
  canceling = 3,
  succeeded = 4,
  canceled = 5,
  aborted = 6,
};

struct GoalStatus {
  GoalInfo goal_info;
  std::int8_t status = 0;  // a GoalState
};
TAKT_MESSAGE(GoalStatus, "action_msgs/msg/GoalStatus", goal_info, status);

struct GoalStatusArray {
  std::vector<GoalStatus> status_list;
};
TAKT_MESSAGE(GoalStatusArray, "action_msgs/msg/GoalStatusArray", status_list);

enum class CancelGoalError : std::int8_t {
  none = 0,
  rejected = 1,
  unknown_goal_id = 2,
  goal_terminated = 3,
};

/// Which goals: with neither id nor stamp all; with a stamp those accepted until then, and with an
/// id that one too.
struct CancelGoal {
  struct Request {
    GoalInfo goal_info;
  };
  struct Response {
    std::int8_t return_code = 0;  // a CancelGoalError
    std::vector<GoalInfo> goals_canceling;
  };
};
TAKT_MESSAGE(CancelGoal::Request, "action_msgs/srv/CancelGoal_Request", goal_info);
TAKT_MESSAGE(CancelGoal::Response, "action_msgs/srv/CancelGoal_Response", return_code,
             goals_canceling);

}  // namespace takt::action_msgs

#endif  // TAKT_MESSAGES_PACKAGES_ACTION_MSGS_HPP_
