// A static object that is never destroyed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_NEVER_DESTROYED_HPP_
#define TAKT_BASE_NEVER_DESTROYED_HPP_

#include <cstddef>
#include <new>
#include <utility>

namespace takt::detail {

/// For a static object that others may use while static objects are destroyed: a program may keep
/// its nodes in variables with static storage, and their destructors use the library. It lies in
/// place, so the first use allocates nothing:
///
///     static NeverDestroyed<PiMutex> mutex;
///     return *mutex;
///
/// Thread safety and real-time: as those of T.
template <class T>
class NeverDestroyed {
 public:
  template <class... Arguments>
  explicit NeverDestroyed(Arguments&&... arguments)
      : object_(*new (storage_) T(std::forward<Arguments>(arguments)...)) {}
  NeverDestroyed(const NeverDestroyed&) = delete;
  NeverDestroyed& operator=(const NeverDestroyed&) = delete;

  T& operator*() noexcept { return object_; }

 private:
  alignas(T) std::byte storage_[sizeof(T)];
  T& object_;
};

}  // namespace takt::detail

#endif  // TAKT_BASE_NEVER_DESTROYED_HPP_
