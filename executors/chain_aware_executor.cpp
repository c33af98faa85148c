// At every dispatch the most urgent callback of all that are ready then, as in PiCAS (RTAS 2021):
// no snapshot stands between a critical callback and its start. One thread; several chains are
// several executors. SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

TAKT_REGISTER_EXECUTOR("chain_aware", "the most urgent callback at every dispatch (PiCAS)",
                       DispatchingExecutor, .readiness = Readiness::events,
                       .scheduler = "chain_priority")

}  // namespace takt
