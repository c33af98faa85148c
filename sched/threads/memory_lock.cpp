// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/memory_lock.hpp"

#include <cerrno>
#include <cstddef>

#include <alloca.h>
#include <fmt/format.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {

std::string lock_memory(Realtime realtime) {
  if (realtime == Realtime::off) return {};
  // Freed memory stays ours, and large blocks come from the heap: a fresh mapping costs 0.4 µs a
  // page at its first touch, which is 2 ms for 5 MB.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  const int error_number = errno;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const std::string refused = fmt::format(
      "memory lock: {} (RLIMIT_MEMLOCK is {} bytes; give the user memlock in "
      "/etc/security/limits.conf, or the program CAP_IPC_LOCK)",
      errno_message(error_number), limit.rlim_cur);
  if (realtime == Realtime::require) {
    throw Error(refused, "grant it, or write `realtime: prefer` to go on without");
  }
  return refused;
}

void prefault_stack(std::size_t bytes) noexcept {
  // volatile: otherwise the compiler removes the writes, as nothing reads them.
  volatile std::byte* const stack = static_cast<std::byte*>(alloca(bytes));
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  for (std::size_t offset = 0; offset < bytes; offset += page) stack[offset] = std::byte{0};
}

}  // namespace takt
