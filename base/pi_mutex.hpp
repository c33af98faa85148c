// A mutex whose holder inherits the priority of the most urgent thread that waits for it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_PI_MUTEX_HPP_
#define TAKT_BASE_PI_MUTEX_HPP_

#include <pthread.h>

#include "takt/base/held_locks.hpp"
#include "takt/base/lock_order.hpp"
#include "takt/base/thread_safety.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// PTHREAD_PRIO_INHERIT, for every lock that threads of different priority share while a system
/// runs. Meets the standard's Lockable requirements. Its place in the order of locks is a part of
/// its type, so that it costs nothing where it is not checked.
/// Thread safety: every method from any thread.
/// Real-time: uncontended it is two atomic operations; a waiter waits as long as the holder
/// holds, because no thread of a priority between theirs can preempt the holder.
template <LockRank kRank>
class TAKT_LOCK RankedMutex {
 public:
  using IsChecked = void;

  RankedMutex() noexcept {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
  }
  ~RankedMutex() { pthread_mutex_destroy(&mutex_); }
  RankedMutex(const RankedMutex&) = delete;
  RankedMutex& operator=(const RankedMutex&) = delete;

  void lock() noexcept TAKT_ACQUIRES() {
    detail::lock_is_wanted(kRank);
    pthread_mutex_lock(&mutex_);
    detail::lock_is_held(kRank);
  }
  /// It does not wait, but what it gets is held: so it keeps to the order, too.
  bool try_lock() noexcept TAKT_TRIES() {
    detail::lock_is_wanted(kRank);
    const bool locked = pthread_mutex_trylock(&mutex_) == 0;
    if (locked) detail::lock_is_held(kRank);
    return locked;
  }
  void unlock() noexcept TAKT_RELEASES() {
    detail::lock_is_released(kRank);
    pthread_mutex_unlock(&mutex_);
  }

 private:
  pthread_mutex_t mutex_;
};

/// One under which no other is taken.
using PiMutex = RankedMutex<LockRank::leaf>;

}  // namespace takt

#endif  // TAKT_BASE_PI_MUTEX_HPP_
