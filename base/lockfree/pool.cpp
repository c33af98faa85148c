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
  const std::lock_guard lock(waiting->mutex);
  if (closed != nullptr) waiting->pools.push_back(closed);
  std::erase_if(waiting->pools, [](PoolBase* pool) {
    if (!pool->all_home()) return false;
    delete pool;
    return true;
  });
}

}  // namespace takt
