// Which callback comes before which, as a scheduler decides.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_RANKS_HPP_
#define TAKT_SCHED_RANKS_HPP_

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/sched/scheduler.hpp"

namespace TAKT_PUBLIC takt {

/// The places of callbacks that become ready at the same time, from 0. Those between which the
/// order of arrival decides have the same. The scheduler's order must not depend on what it has
/// served.
/// Thread safety: a pure function. Real-time: no.
std::vector<std::size_t> ranks_of(std::span<const CallbackInfo> infos, const std::string& scheduler,
                                  const OwnValues& own = {});

/// Whether a callback comes after all others that have urgencies and deadlines when it is demoted,
/// see demoted(). The same.
bool heeds_demotion(const std::string& scheduler, const OwnValues& own = {});

}  // namespace takt

#endif  // TAKT_SCHED_RANKS_HPP_
