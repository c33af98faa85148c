// A value that nobody reaches without its lock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_GUARDED_HPP_
#define TAKT_BASE_GUARDED_HPP_

#include <memory>
#include <mutex>
#include <utility>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

/// `guarded.lock()->member` holds the lock to the end of the statement; `const auto access =
/// guarded.lock();` to the end of the block. Copy what must be looked at for longer: a thread that
/// "must have ended by now" may still run.
/// Thread safety: from any thread. Real-time: as PiMutex.
template <class T, LockRank kRank = LockRank::leaf>
class Guarded {
  using Mutex = RankedMutex<kRank>;

 public:
  template <class Value>
  class Access {
   public:
    Access(Value& value, Mutex& mutex) : lock_(mutex), value_(value) {}
    Value* operator->() const noexcept { return std::addressof(value_); }
    Value& operator*() const noexcept { return value_; }

   private:
    const std::lock_guard<Mutex> lock_;
    Value& value_;
  };

  Access<T> lock() { return {value_, mutex_}; }
  Access<const T> lock() const { return {value_, mutex_}; }

 private:
  mutable Mutex mutex_;
  T value_{};
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_BASE_GUARDED_HPP_
