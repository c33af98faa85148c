// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatch_lock.hpp"

#include "takt/base/spin_pause.hpp"

namespace takt::detail {

void DispatchLock::wait() noexcept {
  constexpr int kLooks = 64;  // about a microsecond
  for (int look = 0; look < kLooks; ++look) {
    spin_pause();
    if (mutex_.try_lock()) return;
  }
  mutex_.lock();
}

}  // namespace takt::detail
