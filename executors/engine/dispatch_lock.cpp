// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/dispatch_lock.hpp"

#include <mutex>
#include <utility>

#include <linux/futex.h>
#include <linux/membarrier.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/spin_pause.hpp"

namespace takt::detail {
namespace {

// A container may not grant it. Then nobody is favoured.
bool has_barrier() noexcept {
  static const bool has =
      syscall(SYS_membarrier, MEMBARRIER_CMD_REGISTER_PRIVATE_EXPEDITED, 0, 0) == 0;
  return has;
}

}  // namespace

DispatchLock::DispatchLock(std::size_t workers, bool may_favour)
    : may_favour_(may_favour && has_barrier()), workers_(workers) {
  for (std::size_t i = 0; i < workers; ++i) workers_[i].index = i;
}

DispatchLock::Worker& DispatchLock::enter(std::size_t index) noexcept {
  workers_[index].thread = static_cast<std::uint32_t>(gettid());
  return workers_[index];
}

// A dispatch takes a fraction of a microsecond, a wait in the kernel several.
bool DispatchLock::look_for_word(Worker& self) noexcept {
  constexpr int kLooks = 64;
  for (int look = 0; look < kLooks; ++look) {
    spin_pause();
    if (word_.load(std::memory_order_relaxed) == 0 && try_lock(self)) return true;
  }
  return false;
}

// Not for a favourite, which keeps the word. Once a callback: the owner may be a thread that this
// one has preempted.
bool DispatchLock::look_from_callback(Worker& self) noexcept {
  if (std::exchange(self.has_met_another, true)) return false;
  return favourite_.load(std::memory_order_relaxed) == nullptr && look_for_word(self);
}

// Most waits end with the first looks. Then nobody had to know of them: what counts them, and the
// title, lies in a cache line that would go from one waiter to the next.
void DispatchLock::wait(Worker& self) noexcept {
  self.has_met_another = true;
  const bool looks_first = favourite_.load(std::memory_order_relaxed) == nullptr;
  if (looks_first && look_for_word(self)) return;
  waiting_.fetch_add(1);  // before it looks for a favourite: see favour()
  bool has_it = take_title(self);
  if (has_it) {
    self.has_met_another = false;
  } else if (!looks_first) {
    has_it = look_for_word(self);
  }
  while (!has_it && !(has_it = try_lock(self))) {
    has_it = syscall(SYS_futex, &word_, FUTEX_LOCK_PI_PRIVATE, 0, nullptr) == 0;
    // Acquire: pairs with the release of the thread from which the kernel has it.
    (void)word_.load(std::memory_order_acquire);
  }
  waiting_.fetch_sub(1);
}

void DispatchLock::release_to_waiter() noexcept {
  // The bit is set already. Release: pairs with the load in wait; the kernel's writes are not part
  // of the memory model.
  word_.fetch_or(FUTEX_WAITERS, std::memory_order_release);
  syscall(SYS_futex, &word_, FUTEX_UNLOCK_PI_PRIVATE, 0, nullptr);
}

// It becomes the favourite, and then looks for waiters; a waiter counts itself, and then looks for
// a favourite. Both are sequentially consistent, so no waiter waits for a favourite's word.
void DispatchLock::favour(Worker& self) noexcept {
  if (!may_favour_) return;
  self.is_favourite = true;
  favourite_.store(&self);
  if (waiting_.load() == 0) return;
  const std::lock_guard lock(title_);
  favourite_.store(nullptr);
  self.is_favourite = false;
}

// Takes the word from a favourite that is not inside. Returns false if there was none, or it was.
bool DispatchLock::take_title(Worker& self) noexcept {
  const std::lock_guard lock(title_);
  Worker* const favourite = favourite_.exchange(nullptr);
  if (favourite == nullptr) return false;
  syscall(SYS_membarrier, MEMBARRIER_CMD_PRIVATE_EXPEDITED, 0, 0);
  // Acquire: pairs with the store in unlock.
  if (favourite->is_inside.load(std::memory_order_acquire)) return false;
  word_.store(self.thread);  // nobody else writes it, see lose_title()
  return true;
}

// The favourite has lost its title, and is not inside. Only after the one that took it has let go
// of `title_` is it certain who owns the word.
void DispatchLock::lose_title(Worker& self) noexcept {
  self.is_favourite = false;
  { const std::lock_guard lock(title_); }
  if ((word_.load(std::memory_order_relaxed) & FUTEX_TID_MASK) == self.thread) release(self);
}

void DispatchLock::unlock_and_leave(Worker& self) noexcept {
  if (self.is_favourite) {
    const std::lock_guard lock(title_);
    Worker* expected = &self;
    favourite_.compare_exchange_strong(expected, nullptr);
    self.is_favourite = false;
  }
  in_a_row_ = 0;  // it may become the favourite again
  self.is_inside.store(false, std::memory_order_relaxed);
  release(self);
}

}  // namespace takt::detail
