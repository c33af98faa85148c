// Serves a snapshot of what is ready when a trigger says so, in the order that the user lists: any
// callback is ready, all are, one certain is, or the user's own function of them. With a period, by
// logical execution time (Giotto; rclc's LET): inputs are taken together at its beginning, and
// outputs are sent together at its end, however long the callbacks took. One thread.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

TAKT_REGISTER_EXECUTOR("triggered", "in the user's order when a trigger says so, or by LET (rclc)",
                       .readiness = Readiness::wait_set, .scheduler = "listed", .triggered = true)

}  // namespace takt
