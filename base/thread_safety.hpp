// Which lock guards what, in words that clang checks: tools/check/thread_safety.py.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_THREAD_SAFETY_HPP_
#define TAKT_BASE_THREAD_SAFETY_HPP_

#include <mutex>

#include "takt/base/visibility.hpp"

#ifdef __clang__
#define TAKT_CHECKED(...) __attribute__((__VA_ARGS__))
#else
#define TAKT_CHECKED(...)
#endif

/// A class of locks; it also has `using IsChecked = void`.
#define TAKT_LOCK TAKT_CHECKED(capability("lock"))
/// A class of objects that hold a lock as long as they live.
#define TAKT_LOCK_HOLDER TAKT_CHECKED(scoped_lockable)
/// A field: only with this lock held.
#define TAKT_GUARDED_BY(lock) TAKT_CHECKED(guarded_by(lock))
/// A function: called with this lock held, and returns with it.
#define TAKT_REQUIRES(...) TAKT_CHECKED(requires_capability(__VA_ARGS__))
/// The functions of a lock: their bodies are not checked.
#define TAKT_ACQUIRES(...) TAKT_CHECKED(acquire_capability(__VA_ARGS__), no_thread_safety_analysis)
#define TAKT_TRIES() TAKT_CHECKED(try_acquire_capability(true), no_thread_safety_analysis)
#define TAKT_RELEASES() TAKT_CHECKED(release_capability(), no_thread_safety_analysis)
/// A function that returns a reference to this lock.
#define TAKT_RETURNS_LOCK(lock) TAKT_CHECKED(lock_returned(lock))

namespace TAKT_PUBLIC takt {
namespace detail {

template <class T>
concept CheckedLock = requires {
  typename T::IsChecked;
};

}  // namespace detail
}  // namespace takt

/// As that of the standard library, which does not tell clang what it does.
template <takt::detail::CheckedLock Lock>
class TAKT_LOCK_HOLDER std::lock_guard<Lock> {
 public:
  explicit lock_guard(Lock& lock) TAKT_ACQUIRES(lock) : lock_(lock) { lock.lock(); }
  ~lock_guard() TAKT_RELEASES() { lock_.unlock(); }
  lock_guard(const lock_guard&) = delete;
  lock_guard& operator=(const lock_guard&) = delete;

 private:
  Lock& lock_;
};

#endif  // TAKT_BASE_THREAD_SAFETY_HPP_
