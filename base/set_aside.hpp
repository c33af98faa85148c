// Memory for an object that may never be needed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_SET_ASIDE_HPP_
#define TAKT_BASE_SET_ASIDE_HPP_

#include <atomic>
#include <cstddef>
#include <memory>
#include <new>

#include <sys/mman.h>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Pages of its own for one T, which the kernel gives when they are touched: an object that is not
/// used takes no memory.
///
/// Which is right for a thread with a deadline? To touch all when it is set aside costs the memory
/// of all that might happen: 18 kB for the times of a callback, most of which run never or seldom.
/// To allocate later takes the heap's lock. So the place is taken in advance, and only the pages
/// come later: 0.4 us each, once, by no lock of ours. `memory: lock` (mlockall) brings them at
/// once, so a process that cannot have that microsecond pays with the memory, by the one switch
/// that says so.
/// Thread safety: one thread at a time calls get(); made() from any.
/// Real-time: get() neither blocks nor allocates, but see above. The constructor does.
template <class T>
class SetAside {
 public:
  SetAside()
      : place_(
            mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {
    if (place_ == MAP_FAILED) throw std::bad_alloc();
    madvise(place_, sizeof(T), MADV_NOHUGEPAGE);  // or one touch takes 2 MB
  }
  ~SetAside() {
    if (T* const object = made_.load()) std::destroy_at(object);
    munmap(place_, sizeof(T));
  }
  SetAside(const SetAside&) = delete;
  SetAside& operator=(const SetAside&) = delete;

  /// Makes it at the first call.
  T& get() noexcept {
    // Relaxed: the same thread has made it, or one before it.
    T* const object = made_.load(std::memory_order_relaxed);
    return object != nullptr ? *object : make();
  }
  /// nullptr: not yet.
  const T* made() const noexcept {
    return made_.load(std::memory_order_acquire);
  }  // pairs with make()

 private:
  [[gnu::cold, gnu::noinline]] T& make() noexcept {
    T* const object = new (place_) T();
    made_.store(object, std::memory_order_release);  // pairs with made()
    return *object;
  }

  void* const place_;
  std::atomic<T*> made_{nullptr};
};

}  // namespace takt

#endif  // TAKT_BASE_SET_ASIDE_HPP_
