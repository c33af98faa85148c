// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/pool.hpp"

#include <mutex>
#include <vector>

namespace takt {

void PoolBase::sweep(PoolBase* closed) noexcept {
  struct Waiting {
    std::mutex mutex;
    std::vector<PoolBase*> pools;
  };
  // Leaked on purpose: pools may be closed after static objects were destroyed.
  static auto* waiting = new Waiting;
  std::vector<PoolBase*> home;
  {
    const std::lock_guard lock(waiting->mutex);
    if (closed != nullptr) waiting->pools.push_back(closed);
    std::erase_if(waiting->pools, [&](PoolBase* pool) {
      if (!pool->all_home()) return false;
      home.push_back(pool);
      return true;
    });
  }
  for (PoolBase* pool : home) delete pool;  // after the unlock: its objects may own other pools
}

}  // namespace takt
