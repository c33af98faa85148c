// The lock around the dispatch of an executor with several workers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_
#define TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_PUBLIC detail {

/// A lock with priority inheritance that favours a worker which is alone with it: it then costs
/// that worker two stores and two loads, and no atomic operation, as long as no other wants it.
/// 1. The word holds the owner's thread id, as the kernel's futexes with priority inheritance do. A
///    worker that cannot have it spins for a moment, then waits in the kernel.
/// 2. A worker that took the lock many times in a row becomes the favourite: from then on it stays
///    the owner of the word, and only notes when it is inside.
/// 3. Another worker ends that: it takes the favourite's title, makes the kernel execute a barrier
///    on all CPUs of the process (membarrier), and looks whether the favourite is inside. If not,
///    it takes the word. If so, it waits for it in the kernel, and the favourite, which has to look
///    at its title after each note, unlocks the word.
/// 4. The favourite notes, then looks at its title; the other takes the title, then looks at the
///    note. The kernel's barrier stands for the one that the favourite does not execute, so at
///    least one of the two sees the other.
/// Thread safety: a worker is used by one thread at a time.
/// Real-time: as PiMutex; a waiter may send one interrupt to the process's other running threads.
class DispatchLock {
 public:
  /// Used by the worker itself, but for the last.
  struct alignas(64) Worker {
    std::size_t index = 0;
    std::uint32_t thread = 0;
    std::uint32_t meetings_in_a_row = 0;
    bool has_met_another = false;        // another had the lock when it came; not yet counted
    bool is_favourite = false;           // as it knows
    std::atomic<bool> is_inside{false};  // has the lock, or is about to get it
  };

  /// `may_favour`: false for workers that a manual clock runs in turn.
  DispatchLock(std::size_t workers, bool may_favour);

  /// The calling thread is that worker.
  Worker& enter(std::size_t index) noexcept;
  /// Returns true if no other worker has had it since this one's last dispatch.
  bool lock(Worker& self) noexcept {
    if (enter_as_favourite(self)) return true;
    if (!try_lock(self)) [[unlikely]]
      wait(self);
    if (last_ != &self) {
      last_ = &self;
      in_a_row_ = 0;
      return false;
    }
    if (++in_a_row_ == kManyInARow) favour(self);
    return true;
  }
  /// Calls the function with the lock held if the worker, which is in a callback, gets it within a
  /// moment. Otherwise, or if it has it already, returns false.
  template <class Function>
  bool try_run(Worker& self, Function&& function) noexcept {
    if (self.is_inside.load(std::memory_order_relaxed)) return false;
    if (!enter_as_favourite(self) && !try_lock(self) && !look_from_callback(self)) {
      self.is_inside.store(false, std::memory_order_relaxed);
      return false;
    }
    function();
    unlock(self);
    return true;
  }
  /// Called once a dispatch: in how many of these in a row has the worker met another one?
  static std::uint32_t count_meetings(Worker& self) noexcept {
    if (!self.has_met_another) [[likely]] {
      if (self.meetings_in_a_row != 0) self.meetings_in_a_row = 0;
      return 0;
    }
    self.has_met_another = false;
    return ++self.meetings_in_a_row;
  }
  void unlock(Worker& self) noexcept {
    // Release: pairs with the load in take_title.
    self.is_inside.store(false, std::memory_order_release);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    if (favourite_.load(std::memory_order_relaxed) == &self) [[likely]]
      return;
    self.is_favourite ? lose_title(self) : release(self);
  }
  /// As unlock, by a worker that will not be back soon.
  void unlock_and_leave(Worker& self) noexcept;

 private:
  static constexpr std::uint32_t kManyInARow = 64;

  bool enter_as_favourite(Worker& self) noexcept {
    self.is_inside.store(true, std::memory_order_relaxed);  // see 4.
    std::atomic_signal_fence(std::memory_order_seq_cst);
    if (favourite_.load(std::memory_order_relaxed) == &self) [[likely]]
      return true;
    if (self.is_favourite) lose_title(self);
    return false;
  }
  bool try_lock(Worker& self) noexcept {
    std::uint32_t nobody = 0;
    return word_.compare_exchange_strong(nobody, self.thread, std::memory_order_acquire);
  }
  void release(Worker& self) noexcept {
    std::uint32_t owner = self.thread;
    if (!word_.compare_exchange_strong(owner, 0, std::memory_order_release)) [[unlikely]]
      release_to_waiter();
  }
  [[gnu::noinline]] void wait(Worker& self) noexcept;
  bool look_for_word(Worker& self) noexcept;
  [[gnu::noinline]] bool look_from_callback(Worker& self) noexcept;
  [[gnu::noinline]] void release_to_waiter() noexcept;
  [[gnu::noinline]] void favour(Worker& self) noexcept;
  [[gnu::noinline]] void lose_title(Worker& self) noexcept;
  bool take_title(Worker& self) noexcept;

  const bool may_favour_;
  std::vector<Worker> workers_;
  std::atomic<Worker*> favourite_{nullptr};
  PiMutex title_;                          // held where a title is taken or given back
  std::atomic<std::uint32_t> waiting_{0};  // workers that may go to the kernel
  alignas(64) std::atomic<std::uint32_t> word_{0};
  std::uint32_t in_a_row_ = 0;    // guarded by the lock
  const Worker* last_ = nullptr;  // the same
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_EXECUTORS_ENGINE_DISPATCH_LOCK_HPP_
