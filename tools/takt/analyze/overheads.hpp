// What Linux and Takt need besides the callbacks, measured on this machine.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_OVERHEADS_HPP_
#define TAKT_TOOLS_TAKT_OVERHEADS_HPP_

#include "takt/containers/model/system_model.hpp"

namespace takt::tools {

/// Fills `machine: overheads`, each with the 99.9th percentile of about a thousand samples of a
/// SCHED_FIFO thread, if Linux grants it, and says in `facts` how many. Takes two seconds.
void measure_overheads(MachineDescription& machine, MachineFacts& facts);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_OVERHEADS_HPP_
