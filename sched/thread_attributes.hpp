// What Linux is told about a thread: policy, priority, nice value, CPUs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_THREAD_ATTRIBUTES_HPP_
#define TAKT_SCHED_THREAD_ATTRIBUTES_HPP_

#include <string>
#include <string_view>
#include <vector>

namespace takt {

/// A Linux thread policy (sched(7)). Ours, which orders callbacks, is a Scheduler.
enum class ThreadPolicy { other, fifo, rr, batch, idle };

/// What to do when the system refuses what a thread asks for.
enum class Realtime {
  off,      // ask for nothing but name and affinity
  prefer,   // ask; go on with what is granted, and record what was refused
  require,  // ask; a refusal is an Error
};

/// What a thread asks for.
struct ThreadAttributes {
  std::string name;  // Linux shows 15 characters of it
  ThreadPolicy policy = ThreadPolicy::other;
  int priority = 0;           // 1 to 99 for fifo and rr, larger is more urgent; else 0
  int nice = 0;               // -20 to 19, for other and batch
  std::vector<int> affinity;  // CPUs; empty means all

  /// Throws an Error about the first value that can never work here (priority 80 for SCHED_OTHER,
  /// CPU 7 of 2).
  void check() const;
};

/// What a thread has, read back from the kernel.
struct ThreadState {
  std::string name;
  int tid = 0;
  ThreadPolicy policy = ThreadPolicy::other;
  int priority = 0;
  int nice = 0;
  std::vector<int> affinity;
  std::string refused;  // what was asked for and not granted, with the reason; else empty
};

/// Gives the calling thread these attributes and reads back what is in force.
/// Throws Error when something is refused and `realtime` is require. Set-up only.
ThreadState apply(const ThreadAttributes& attributes, Realtime realtime);

/// What the calling thread has.
ThreadState this_thread_state();

/// "SCHED_FIFO" and so on; the names of sched(7) and of the configuration file.
std::string_view to_string(ThreadPolicy policy) noexcept;
/// Throws an Error that lists the valid names.
ThreadPolicy thread_policy(std::string_view name);

/// The CPUs that this process was given when it started.
const std::vector<int>& available_cpus();

}  // namespace takt

#endif  // TAKT_SCHED_THREAD_ATTRIBUTES_HPP_
