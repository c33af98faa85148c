// rclcpp's single-threaded executor: a wait set, one snapshot at each polling point, served in the
// order of the scheduler `ros` by default. The model of Casini et al. (ECRTS 2019).
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

TAKT_REGISTER_EXECUTOR("single_threaded",
                       "a snapshot of what is ready at each polling point, in rclcpp's order",
                       .readiness = Readiness::wait_set, .scheduler = "ros")

}  // namespace takt
