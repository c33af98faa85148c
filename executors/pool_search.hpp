// How long a worker of a pool searches before it sleeps.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_POOL_SEARCH_HPP_
#define TAKT_EXECUTORS_POOL_SEARCH_HPP_

#include "takt/base/time.hpp"

namespace takt {

/// While other workers of its pool work, a worker that finds nothing to run searches for so long,
/// or for `spin` if that is longer: about the cost of a sleep and its wake-up.
inline constexpr Nanoseconds kPoolSearch(20'000);

}  // namespace takt

#endif  // TAKT_EXECUTORS_POOL_SEARCH_HPP_
