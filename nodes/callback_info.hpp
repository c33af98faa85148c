// The data of a callback that a scheduler sees.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_CALLBACK_INFO_HPP_
#define TAKT_NODES_CALLBACK_INFO_HPP_

#include "takt/entities/entity.hpp"
#include "takt/nodes/node.hpp"

namespace takt {

/// The callback's parameters in force, those of its most critical chain included. `ids` has what
/// its executor gives: id, registration, group and node.
/// Thread safety: from any thread. Real-time: no.
CallbackInfo callback_info(const Node& node, const Entity& entity, const CallbackInfo& ids = {});

}  // namespace takt

#endif  // TAKT_NODES_CALLBACK_INFO_HPP_
