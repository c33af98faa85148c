// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cerrno>
#include <ctime>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {
namespace {

/// One futex word that counts posts. FUTEX_WAIT_BITSET takes an absolute CLOCK_MONOTONIC time.
class FutexWaitBackend final : public WaitBackend {
 public:
  explicit FutexWaitBackend(std::size_t) {}

  bool wait(std::size_t, TimePoint deadline) noexcept override {
    timespec time{};
    if (deadline != kNever) {
      const auto since_epoch = deadline.time_since_epoch();
      const auto seconds = std::chrono::floor<std::chrono::seconds>(since_epoch);
      time = {seconds.count(), (since_epoch - seconds).count()};
    }
    for (;;) {
      std::uint32_t posts = posts_.load();
      while (posts != 0) {
        if (posts_.compare_exchange_weak(posts, posts - 1)) return true;
      }
      const long result =
          syscall(SYS_futex, &posts_, FUTEX_WAIT_BITSET_PRIVATE, 0,
                  deadline == kNever ? nullptr : &time, nullptr, FUTEX_BITSET_MATCH_ANY);
      if (result != 0 && errno == ETIMEDOUT && posts_.load() == 0) return false;
    }
  }

  void post() noexcept override {
    posts_.fetch_add(1);
    syscall(SYS_futex, &posts_, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
  }

 private:
  alignas(64) std::atomic<std::uint32_t> posts_{0};
  static_assert(sizeof(posts_) == sizeof(std::uint32_t) &&
                std::atomic<std::uint32_t>::is_always_lock_free);
};

}  // namespace

TAKT_REGISTER_WAIT_BACKEND("futex", "the least work for any number of threads; no file descriptors",
                           FutexWaitBackend, .cost = 1)

}  // namespace takt
