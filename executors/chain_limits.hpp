// How many callbacks of a chain a pool runs at the same time: a limit for each graph, as in
// "ReDAGRT" (arXiv 2603.18238).
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_CHAIN_LIMITS_HPP_
#define TAKT_EXECUTORS_CHAIN_LIMITS_HPP_

#include <memory>

#include "takt/executors/rule.hpp"

namespace takt {

/// The rule that heeds ChainOptions::concurrency.
std::unique_ptr<Rule> make_chain_limits();

}  // namespace takt

#endif  // TAKT_EXECUTORS_CHAIN_LIMITS_HPP_
