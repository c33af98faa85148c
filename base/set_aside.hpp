// Memory that is taken in advance, and of which the kernel gives the pages that are used.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_SET_ASIDE_HPP_
#define TAKT_BASE_SET_ASIDE_HPP_

#include <atomic>
#include <cstddef>
#include <memory>
#include <new>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Memory of which nothing is touched before its owner does: what may be needed in a callback, and
/// mostly is not. All such memory of the process lies together, away from the heap, where what
/// lies beside it would touch its pages.
///
/// Which is right for a thread with a deadline? To touch all when it is set aside costs the memory
/// of all that might happen: 18 kB for the times of a callback, 200 bytes for each message that
/// might be in transit. To allocate later takes the heap's lock. So the place is taken in advance,
/// and only the pages come later: 0.4 us each, once, by no lock of ours. `memory: lock` (mlockall)
/// brings them at once, so a process that cannot have that microsecond pays with the memory, by
/// the one switch that says so.
/// Throws std::bad_alloc. Thread safety: from any thread. Real-time: set-up only.
void* set_aside(std::size_t bytes, std::size_t alignment);
/// What set_aside has returned for these two numbers. The next one that needs so much gets it.
void give_back(void* memory, std::size_t bytes, std::size_t alignment) noexcept;

/// Memory for a T that is made when it is first needed.
/// Thread safety: one thread at a time calls get(); made() from any.
/// Real-time: get() neither blocks nor allocates, but see above. The constructor does.
template <class T>
class SetAside {
 public:
  SetAside() : place_(set_aside(sizeof(T), alignof(T))) {}
  ~SetAside() {
    if (T* const object = made_.load()) std::destroy_at(object);
    give_back(place_, sizeof(T), alignof(T));
  }
  SetAside(const SetAside&) = delete;
  SetAside& operator=(const SetAside&) = delete;

  /// Makes it at the first call.
  T& get() noexcept {
    // Relaxed: the same thread has made it, or one before it.
    T* const object = made_.load(std::memory_order_relaxed);
    return object != nullptr ? *object : make();
  }
  /// nullptr: not yet. Acquire: pairs with make().
  const T* made() const noexcept { return made_.load(std::memory_order_acquire); }

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
