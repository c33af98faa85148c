// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/qos.hpp"

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/keep_last_ring.hpp"

namespace takt {

void QoS::check() const {
  constexpr std::size_t kMaxDepth = KeepLastRing<void>::kMaxDepth;
  if (depth == 0 || depth > kMaxDepth) {
    throw Error(fmt::format("a history of {} messages cannot be kept", depth),
                fmt::format("choose a depth from 1 to {}", kMaxDepth));
  }
}

}  // namespace takt
