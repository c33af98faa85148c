// How many of Takt's locks a thread holds, in builds that check it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_HELD_LOCKS_HPP_
#define TAKT_BASE_HELD_LOCKS_HPP_

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

/// A user's code may wait for anything, and may call anything of Takt, also when it is destroyed.
/// So no thread runs it while it holds one of our locks. Each lock tells when a thread has got it
/// and lets go of it; what calls or destroys a function of a user expects that there is none.
/// Debug and sanitizer builds end the program otherwise (TAKT_CHECK_LOCKS); others do not count.
/// Thread safety: each function is about the calling thread.
/// Real-time: nothing blocks or allocates.
#ifdef TAKT_CHECK_LOCKS
inline thread_local int held_locks = 0;
inline void lock_is_held() noexcept {
  ++held_locks;
}
inline void lock_is_released() noexcept {
  --held_locks;
}
/// `what` names it in the message: "a callback".
void refuse_held_lock(const char* what) noexcept;
inline void expect_no_lock(const char* what) noexcept {
  if (held_locks > 0) refuse_held_lock(what);
}
#else
inline void lock_is_held() noexcept {
}
inline void lock_is_released() noexcept {
}
inline void expect_no_lock(const char*) noexcept {
}
#endif

}  // namespace detail
}  // namespace takt

#endif  // TAKT_BASE_HELD_LOCKS_HPP_
