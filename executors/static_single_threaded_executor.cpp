// As single_threaded, but the set of callbacks is fixed at the first spin: adding or removing later
// is an Error (rclcpp's static executor of Humble).
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

TAKT_REGISTER_EXECUTOR(
    "static_single_threaded",
    "as single_threaded, over a set of callbacks that is fixed at the first spin",
    .readiness = Readiness::wait_set, .scheduler = "ros", .frozen = true)

}  // namespace takt
