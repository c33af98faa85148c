// Which of Takt's locks a thread holds, in builds that check it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_HELD_LOCKS_HPP_
#define TAKT_BASE_HELD_LOCKS_HPP_

#include <cstdint>

#include "takt/base/lock_order.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

/// Each lock says that a thread wants it, before it may have to wait, and when it lets go of it: so
/// the order of LockRank is kept also where no thread waits for another one.
///
/// A user's code may wait for anything, and may call anything of Takt, also when it is destroyed.
/// So no thread runs it while it holds one of our locks: what calls or destroys a function of a
/// user expects that there is none.
///
/// Debug and sanitizer builds end the program otherwise (TAKT_CHECK_LOCKS); others note nothing.
/// Thread safety: each function is about the calling thread.
/// Real-time: nothing blocks or allocates.
#ifdef TAKT_CHECK_LOCKS
static_assert(kLockRanks <= 32);
inline thread_local constinit std::uint32_t held_locks = 0;  // a bit for each rank
void refuse_lock_order(LockRank wanted) noexcept;
inline void lock_is_wanted(LockRank rank) noexcept {
  if ((held_locks >> static_cast<int>(rank)) != 0) refuse_lock_order(rank);
}
inline void lock_is_held(LockRank rank) noexcept {
  held_locks |= std::uint32_t{1} << static_cast<int>(rank);
}
inline void lock_is_released(LockRank rank) noexcept {
  held_locks &= ~(std::uint32_t{1} << static_cast<int>(rank));
}
/// `what` names it in the message: "a callback".
void refuse_held_lock(const char* what) noexcept;
inline void expect_no_lock(const char* what) noexcept {
  if (held_locks != 0) refuse_held_lock(what);
}
#else
inline void lock_is_wanted(LockRank) noexcept {
}
inline void lock_is_held(LockRank) noexcept {
}
inline void lock_is_released(LockRank) noexcept {
}
inline void expect_no_lock(const char*) noexcept {
}
#endif

}  // namespace detail
}  // namespace takt

#endif  // TAKT_BASE_HELD_LOCKS_HPP_
