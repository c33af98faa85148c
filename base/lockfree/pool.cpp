// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/pool.hpp"

#include <mutex>
#include <vector>

namespace takt {

// Pools whose owners have gone while objects were out.
struct PoolBase::Closed {
  std::mutex mutex;
  std::vector<PoolBase*> pools;
};

// Leaked on purpose: pools may be closed after static objects were destroyed.
PoolBase::Closed& PoolBase::closed() {
  static auto* const closed = new Closed;
  return *closed;
}

PoolBase::PoolBase(std::size_t capacity)
    : capacity_(capacity), next_(new std::atomic<std::uint32_t>[capacity]) {
  free_closed();
  for (std::uint32_t i = 0; i < capacity; ++i) push(lendable_, i, i);
}

PoolBase::~PoolBase() = default;

void PoolBase::close() noexcept {
  {
    const std::lock_guard lock(closed().mutex);
    closed().pools.push_back(this);
  }
  free_closed();
}

void PoolBase::free_closed() noexcept {
  const std::lock_guard lock(closed().mutex);
  std::erase_if(closed().pools, [](PoolBase* pool) {
    if (!pool->all_home()) return false;
    delete pool;
    return true;
  });
}

}  // namespace takt
