// SPDX-License-Identifier: Apache-2.0
#include "takt/base/held_locks.hpp"

#include <cstdio>
#include <cstdlib>

namespace takt::detail {

#ifdef TAKT_CHECK_LOCKS
void refuse_held_lock(const char* what) noexcept {
  std::fprintf(stderr, "takt: a user's %s is called or destroyed under a lock of Takt\n", what);
  std::abort();
}
#endif

}  // namespace takt::detail
