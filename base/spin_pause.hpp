// The pause between two checks of a thread that spins.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_SPIN_PAUSE_HPP_
#define TAKT_BASE_SPIN_PAUSE_HPP_

namespace takt {

/// Leaves the core to its other hardware thread, and the cache line to its writer, for some ten
/// nanoseconds.
/// Thread safety: any thread.
/// Real-time: yes.
inline void spin_pause() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__) || defined(__arm__)
  asm volatile("yield" ::: "memory");
#endif
}

}  // namespace takt

#endif  // TAKT_BASE_SPIN_PAUSE_HPP_
