// Includes what a program of nodes needs. Including single headers compiles faster.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TAKT_HPP_
#define TAKT_TAKT_HPP_

// IWYU pragma: begin_exports
#include "takt/containers/component.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/spin.hpp"
#include "takt/executors/wait_set.hpp"
#include "takt/nodes/chain_join.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/nodes/node.hpp"
// IWYU pragma: end_exports

#endif  // TAKT_TAKT_HPP_
