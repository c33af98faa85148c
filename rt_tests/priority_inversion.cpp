// How long does a high-priority thread wait for a lock of a low-priority thread, while a thread of
// medium priority runs?
// SPDX-License-Identifier: Apache-2.0
#include <latch>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "takt/base/clock.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/rt_tests/rt_test.hpp"
#include "takt/sched/threads/realtime_thread.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

constexpr Nanoseconds kHeld = 1ms, kWork = 10ms;

/// All threads are on one CPU: low locks the mutex, then high waits for it and middle runs.
template <class Mutex>
Nanoseconds wait_of_high() {
  Mutex mutex;
  Nanoseconds waited{0};
  std::latch held(1), all_there(3);
  const auto thread = [](int priority, std::function<void()> body) {
    return std::make_unique<RealtimeThread>(rt::realtime_thread(priority), Realtime::require,
                                            std::move(body));
  };
  const auto low = thread(10, [&] {
    const std::lock_guard lock(mutex);
    held.count_down();
    all_there.arrive_and_wait();
    rt::burn(kHeld);
  });
  held.wait();
  const auto middle = thread(20, [&] {
    all_there.arrive_and_wait();
    rt::burn(kWork);
  });
  const auto high = thread(30, [&] {
    all_there.arrive_and_wait();
    const TimePoint start = Clock::steady().now();
    const std::lock_guard lock(mutex);
    waited = Clock::steady().now() - start;
  });
  high->join();
  middle->join();
  low->join();
  return waited;
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(argc, argv,
                  fmt::format("How long does a thread of SCHED_FIFO 30 wait for a lock that one of "
                              "10 holds for {} ms, while one of 20 runs for {} ms?",
                              kHeld / 1ms, kWork / 1ms));
  test.needs_realtime();
  rt::Rounds inheriting, plain;
  for (int round = 0; round < test.rounds(9); ++round) {
    Histogram with, without;
    with.record(wait_of_high<PiMutex>());
    without.record(wait_of_high<std::mutex>());
    inheriting.add(with);
    plain.add(without);
  }
  test.add("PiMutex (Takt's)", inheriting.values());
  test.add("std::mutex", plain.values());
  test.expect_at_most(1. / 3, inheriting.p50_us, plain.p50_us,
                      "with priority inheritance it waits at most a third");
  return test.finish();
}
