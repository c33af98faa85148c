// The lock around the dispatch of an executor.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_
#define TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_

#include "takt/base/pi_mutex.hpp"
#include "takt/base/thread_safety.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_INTERNAL detail {

/// An adaptive mutex with priority inheritance: a thread that finds it taken spins for a moment
/// before it waits in the kernel, because a dispatch takes a fraction of a microsecond, and that
/// wait several.
/// Thread safety and real-time: as PiMutex.
class TAKT_LOCK DispatchLock {
 public:
  using IsChecked = void;

  /// `is_shared`: there are several workers. A single one needs no lock, and none is taken.
  explicit DispatchLock(bool is_shared) noexcept : is_shared_(is_shared) {}

  bool is_shared() const noexcept { return is_shared_; }
  void lock() noexcept TAKT_ACQUIRES() {
    if (is_shared_ && !mutex_.try_lock()) [[unlikely]]
      wait();
  }
  void unlock() noexcept TAKT_RELEASES() {
    if (is_shared_) [[unlikely]]
      mutex_.unlock();
  }

 private:
  void wait() noexcept TAKT_ACQUIRES(mutex_);

  const bool is_shared_;
  RankedMutex<LockRank::dispatch> mutex_;
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_
