// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_backend.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <ctime>
#include <mutex>
#include <vector>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/manual_clock.hpp"

namespace takt {
namespace {

/// One futex word that counts posts. FUTEX_WAIT_BITSET takes an absolute CLOCK_MONOTONIC time.
class FutexWaitBackend final : public WaitBackend {
 public:
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

/// Each worker is a participant of the manual clock. A post goes to the first that sleeps, in
/// order of index, so that a run always takes the same way.
class ManualWaitBackend final : public WaitBackend {
 public:
  ManualWaitBackend(ManualClock& clock, std::size_t workers) : clock_(clock), workers_(workers) {
    static std::atomic<std::uint64_t> backends{0};
    const std::uint64_t backend = backends.fetch_add(1);
    for (std::size_t i = 0; i < workers; ++i) workers_[i].participant.rank = {backend, i};
  }

  void enter(std::size_t worker) override {
    clock_.join(workers_[worker].participant);
    workers_[worker].joined = true;
  }
  void leave(std::size_t worker) noexcept override {
    if (std::exchange(workers_[worker].joined, false)) clock_.leave(workers_[worker].participant);
  }

  bool wait(std::size_t worker, TimePoint deadline) noexcept override {
    Worker& self = workers_[worker];
    {
      const std::lock_guard lock(mutex_);
      if (posts_ != 0) return --posts_, true;
      self.sleeping = true;
    }
    // The caller of spin_once controls the clock until it has to wait.
    if (!self.joined) enter(worker);
    const bool woken = clock_.wait(self.participant, deadline);
    const std::lock_guard lock(mutex_);
    self.sleeping = false;
    if (!woken && posts_ != 0) return --posts_, true;
    return woken;
  }

  void post() noexcept override {
    const std::lock_guard lock(mutex_);
    const auto sleeper = std::find_if(workers_.begin(), workers_.end(),
                                      [](const Worker& worker) { return worker.sleeping; });
    if (sleeper == workers_.end()) {
      ++posts_;
    } else {
      sleeper->sleeping = false;
      clock_.wake(sleeper->participant);
    }
  }

 private:
  struct Worker {
    ManualClock::Participant participant;
    bool joined = false;
    bool sleeping = false;
  };
  ManualClock& clock_;
  std::mutex mutex_;
  std::size_t posts_ = 0;
  std::vector<Worker> workers_;
};

}  // namespace

std::unique_ptr<WaitBackend> make_wait_backend(Clock& clock, std::size_t workers) {
  if (ManualClock* manual = clock.as_manual()) {
    return std::make_unique<ManualWaitBackend>(*manual, workers);
  }
  return std::make_unique<FutexWaitBackend>();
}

}  // namespace takt
