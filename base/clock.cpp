// SPDX-License-Identifier: Apache-2.0
#include "takt/base/clock.hpp"

#include <atomic>
#include <ctime>

#include "takt/base/never_destroyed.hpp"
#include "takt/base/steady_clock.hpp"

namespace takt {
namespace {

Nanoseconds read(clockid_t id) noexcept {
  timespec time;
  clock_gettime(id, &time);
  return std::chrono::seconds(time.tv_sec) + Nanoseconds(time.tv_nsec);
}

class SteadyClock final : public Clock {
 public:
  TimePoint now() const noexcept override { return TimePoint(read(CLOCK_MONOTONIC)); }
};

constinit std::atomic<Clock*> instead_of_steady{nullptr};

}  // namespace

Clock& Clock::steady() noexcept {
  if (Clock* const other = instead_of_steady.load(std::memory_order_acquire)) return *other;
  static detail::NeverDestroyed<SteadyClock> clock;  // threads of a program may read it at its exit
  return *clock;
}

void replace_steady_clock(Clock& clock) noexcept {
  // Partner: steady(), which then sees the clock as it was made.
  instead_of_steady.store(&clock, std::memory_order_release);
}

Nanoseconds thread_cpu_time() noexcept {
  return read(CLOCK_THREAD_CPUTIME_ID);
}

void burn_cpu(Nanoseconds amount) noexcept {
  const Nanoseconds end = thread_cpu_time() + amount;
  // Reading this clock is a system call of about 0.2 µs, so the loop between two reads is what
  // sets the resolution, not the cost.
  while (thread_cpu_time() < end) {
    for (int i = 0; i < 64; ++i) asm volatile("" ::: "memory");
  }
}

}  // namespace takt
