// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/chain_aware_executor.hpp"

namespace takt {

ChainAwareExecutor::ChainAwareExecutor(const ExecutorOptions& options)
    : DispatchingExecutor(
          options,
          {.readiness = Readiness::events, .scheduler = "chain_priority", .max_threads = 1}) {
}

TAKT_REGISTER_EXECUTOR("chain_aware", "the most urgent callback at every dispatch (PiCAS)",
                       ChainAwareExecutor)

}  // namespace takt
