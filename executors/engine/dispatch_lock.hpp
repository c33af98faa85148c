// The lock around the dispatch of an executor with several workers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_
#define TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_INTERNAL detail {

/// A mutex with priority inheritance. A thread that finds it taken looks again for a moment before
/// it waits in the kernel: a dispatch takes a fraction of a microsecond, that wait several.
/// Thread safety and real-time: as PiMutex.
class DispatchLock {
 public:
  void lock() noexcept {
    if (!mutex_.try_lock()) [[unlikely]]
      wait();
  }
  void unlock() noexcept { mutex_.unlock(); }

 private:
  void wait() noexcept;

  PiMutex mutex_;
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_
