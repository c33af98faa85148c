// SPDX-License-Identifier: Apache-2.0
#include "takt/base/realtime_scope.hpp"

#include <atomic>
#include <cstdlib>
#include <utility>

#include <sys/resource.h>

namespace takt {
namespace {
// Initial-exec, because a lazily allocated thread-local would call malloc from inside malloc.
[[gnu::tls_model("initial-exec")]] thread_local constinit std::uint64_t allocations_of_thread = 0;
[[gnu::tls_model("initial-exec")]] thread_local constinit std::uint64_t foreign_of_thread = 0;
[[gnu::tls_model("initial-exec")]] thread_local constinit bool in_foreign_code = false;
}  // namespace

void count_allocation() noexcept {
  ++(in_foreign_code ? foreign_of_thread : allocations_of_thread);
}

std::uint64_t allocations_of_this_thread() noexcept {
  return allocations_of_thread;
}

ForeignCode::ForeignCode() noexcept : outer_(std::exchange(in_foreign_code, true)) {
}
ForeignCode::~ForeignCode() {
  in_foreign_code = outer_;
}

ThreadCounters ThreadCounters::now() noexcept {
  rusage usage;
  getrusage(RUSAGE_THREAD, &usage);
  return {allocations_of_thread,
          foreign_of_thread,
          static_cast<std::uint64_t>(usage.ru_minflt),
          static_cast<std::uint64_t>(usage.ru_majflt),
          static_cast<std::uint64_t>(usage.ru_nvcsw),
          static_cast<std::uint64_t>(usage.ru_nivcsw)};
}

bool allocations_are_counted() noexcept {
  static const bool counted = [] {
    const std::uint64_t before = allocations_of_thread;
    // volatile: the compiler knows malloc, and would otherwise remove the unused block or assume
    // that the counter does not change.
    void* volatile block = std::malloc(1);
    std::free(block);
    asm volatile("" ::: "memory");
    return std::exchange(allocations_of_thread, before) != before;  // the trial does not count
  }();
  return counted;
}

}  // namespace takt
