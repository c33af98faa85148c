// Prevents page faults: locks pages and touches stacks in advance.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_THREADS_MEMORY_LOCK_HPP_
#define TAKT_SCHED_THREADS_MEMORY_LOCK_HPP_

#include <cstddef>
#include <string>

#include "takt/base/visibility.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_PUBLIC takt {

/// Locks all present and future pages of the process (mlockall), and sets malloc to keep its
/// memory, so that no callback meets a page fault. Returns what was refused and why, or nothing.
/// Throws Error when refused and `realtime` is require. Set-up only.
std::string lock_memory(Realtime realtime);

/// Touches the next `bytes` of the calling thread's stack.
void prefault_stack(std::size_t bytes = 256 * 1024) noexcept;

}  // namespace takt

#endif  // TAKT_SCHED_THREADS_MEMORY_LOCK_HPP_
