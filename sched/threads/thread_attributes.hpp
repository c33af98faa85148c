// The Linux attributes of a thread: policy, priority, reservation, nice value, CPUs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_THREADS_THREAD_ATTRIBUTES_HPP_
#define TAKT_SCHED_THREADS_THREAD_ATTRIBUTES_HPP_

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/available_cpus.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A Linux scheduling policy of threads (sched(7)). The order of callbacks is that of a Scheduler.
enum class ThreadPolicy { other, fifo, rr, batch, idle, deadline };

/// Whether it comes before all threads of the usual policies: fifo, rr or deadline.
bool is_realtime(ThreadPolicy policy) noexcept;

/// The reaction when the system refuses a thread's attributes.
enum class Realtime {
  off,      // ask for nothing but name and affinity
  prefer,   // ask; go on with what is granted, and record what was refused
  require,  // ask; a refusal is an Error
};

/// Requested attributes of a thread.
struct ThreadAttributes {
  std::string name;  // Linux shows 15 characters of it
  ThreadPolicy policy = ThreadPolicy::other;
  int priority = 0;           // 1 to 99 for fifo and rr, larger is more urgent; else 0
  int nice = 0;               // -20 to 19, for other and batch
  std::vector<int> affinity;  // of usable_cpus(); empty means available_cpus()
  /// For deadline: in every period the kernel gives the thread this much CPU time, before the
  /// deadline, and then no more. It may start threads; they are SCHED_OTHER.
  Nanoseconds runtime{0};
  Nanoseconds deadline{0};  // from the beginning of the period; 0: the period
  Nanoseconds period{0};

  /// Throws an Error about the first value that can never work here (priority 80 for SCHED_OTHER,
  /// CPU 7 of 2).
  void check() const;
  /// Its parts, for a caller that knows the line of each value.
  void check_priority() const;
  void check_nice() const;
  void check_reservation() const;
  void check_affinity() const;
};

/// The attributes of a thread in force, read from the kernel.
struct ThreadState {
  std::string name;
  int tid = 0;
  ThreadPolicy policy = ThreadPolicy::other;
  int priority = 0;
  int nice = 0;
  std::vector<int> affinity;
  Nanoseconds runtime{0}, deadline{0}, period{0};  // of deadline, else 0
  std::string refused;  // requested attributes that were refused, with the reason; else empty
};

/// Gives the calling thread these attributes and reads back what is in force.
/// Throws Error when something is refused and `realtime` is require. Set-up only.
ThreadState apply(const ThreadAttributes& attributes, Realtime realtime);

/// Throws Error if the SCHED_DEADLINE threads among these, which are valid each, reserve more than
/// available: `sched_rt_runtime_us` of each `sched_rt_period_us`, on each CPU of this process. The
/// kernel may still refuse them, because other processes and the kernel itself reserve time, too.
/// Set-up only.
void check_admission(std::span<const ThreadAttributes> threads);
/// The same, where so much may be reserved, in CPUs.
void check_admission(std::span<const ThreadAttributes> threads, double most_cpus);

/// What Linux grants to the SCHED_FIFO and SCHED_RR threads of a CPU: so much of each period.
struct RealtimeGrant {
  Nanoseconds runtime = std::chrono::seconds(1), period = std::chrono::seconds(1);

  friend bool operator==(const RealtimeGrant&, const RealtimeGrant&) = default;
  bool is_limited() const noexcept { return runtime < period; }
  double share() const noexcept {
    return static_cast<double>(runtime.count()) / static_cast<double>(period.count());
  }
};
/// By `sched_rt_runtime_us`, the control group, and the fair server of newer kernels. Of several
/// limits the least share counts, and the longest period.
RealtimeGrant realtime_grant();
/// "950 ms of each second"
std::string to_string(const RealtimeGrant& grant);
/// How long a thread of SCHED_RR runs before others of its priority: `sched_rr_timeslice_ms`.
Nanoseconds turn_of_round_robin();
/// What the fair server of newer kernels (6.12) may take of each second of a CPU, for threads that
/// have no real-time policy and waited, before those that have one, SCHED_DEADLINE too. 0: there is
/// none.
Nanoseconds fair_server();
/// From one look of the kernel at what threads have used to the next: that late it notices.
Nanoseconds scheduler_tick();

/// That a thread runs on CPUs which this process was not started on, in words; empty: it does not.
std::string cpus_outside(const ThreadState& state);

/// What the calling thread has.
ThreadState this_thread_state();
/// What a thread of this process has.
ThreadState thread_state(int tid);

/// From here on the kernel ends the sleeps of the calling thread when they are over. Threads that
/// are not real-time ones otherwise have a slack of 50 µs, which spares it interrupts.
/// Real-time: one system call for each thread, the first time.
void wake_up_on_time() noexcept;

/// "SCHED_FIFO" and so on; the names of sched(7) and of the configuration file.
std::string_view to_string(ThreadPolicy policy) noexcept;
/// Throws an Error that lists the valid names.
ThreadPolicy thread_policy(std::string_view name);

}  // namespace takt

#endif  // TAKT_SCHED_THREADS_THREAD_ATTRIBUTES_HPP_
