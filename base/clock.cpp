// SPDX-License-Identifier: Apache-2.0
#include "takt/base/clock.hpp"

#include <ctime>

#include "takt/base/never_destroyed.hpp"

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

}  // namespace

Clock& Clock::steady() noexcept {
  static detail::NeverDestroyed<SteadyClock> clock;  // threads of a program may read it at its exit
  return *clock;
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
