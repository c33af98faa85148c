// At every dispatch, runs the most urgent of all ready callbacks, as in PiCAS (RTAS 2021): a
// critical callback does not wait for the end of a snapshot. One thread; several chains have
// several executors.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

TAKT_REGISTER_EXECUTOR("chain_aware", "the most urgent callback at every dispatch (PiCAS)",
                       .readiness = Readiness::events, .scheduler = "chain_priority")

}  // namespace takt
