// Counts what a real-time thread should avoid: allocations, page faults, context switches.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_REALTIME_SCOPE_HPP_
#define TAKT_BASE_REALTIME_SCOPE_HPP_

#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Counters of a thread, since its start or between two points.
struct ThreadCounters {
  std::uint64_t allocations = 0;          // only where allocations_are_counted()
  std::uint64_t foreign_allocations = 0;  // the same, inside ForeignCode
  std::uint64_t minor_faults = 0;
  std::uint64_t major_faults = 0;
  std::uint64_t voluntary_switches = 0;    // it slept
  std::uint64_t involuntary_switches = 0;  // it was preempted

  friend ThreadCounters operator-(ThreadCounters a, const ThreadCounters& b) noexcept {
    a.allocations -= b.allocations;
    a.foreign_allocations -= b.foreign_allocations;
    a.minor_faults -= b.minor_faults;
    a.major_faults -= b.major_faults;
    a.voluntary_switches -= b.voluntary_switches;
    a.involuntary_switches -= b.involuntary_switches;
    return a;
  }
  ThreadCounters& operator+=(const ThreadCounters& other) noexcept {
    allocations += other.allocations;
    foreign_allocations += other.foreign_allocations;
    minor_faults += other.minor_faults;
    major_faults += other.major_faults;
    voluntary_switches += other.voluntary_switches;
    involuntary_switches += other.involuntary_switches;
    return *this;
  }
  static ThreadCounters now() noexcept;
};

/// Whether this program counts its allocations: it links `takt::allocation_counter`, or was started
/// with libtakt_allocations.so preloaded, and no sanitizer has taken malloc over.
bool allocations_are_counted() noexcept;

/// The counters of the calling thread since the object was made.
/// Thread safety: an object belongs to the thread that made it.
/// Real-time: each reading is one system call (getrusage), nothing allocates.
class RealtimeScope {
 public:
  RealtimeScope() noexcept : start_(ThreadCounters::now()) {}
  ThreadCounters so_far() const noexcept { return ThreadCounters::now() - start_; }

 private:
  const ThreadCounters start_;
};

/// While the object lives, its thread is inside a library that is known to allocate (Cyclone DDS):
/// its allocations are counted separately.
/// Thread safety: made and destroyed on one thread.
/// Real-time: neither blocks nor allocates.
class ForeignCode {
 public:
  ForeignCode() noexcept;
  ~ForeignCode();
  ForeignCode(const ForeignCode&) = delete;
  ForeignCode& operator=(const ForeignCode&) = delete;

 private:
  const bool outer_;
};

/// So far, of the calling thread, without those inside ForeignCode. Real-time: nothing blocks.
std::uint64_t allocations_of_this_thread() noexcept;

/// For allocation_counter.cpp only: the calling thread allocated once more.
void count_allocation() noexcept;

}  // namespace takt

#endif  // TAKT_BASE_REALTIME_SCOPE_HPP_
