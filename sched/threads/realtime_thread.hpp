// A thread that has its attributes before it runs anything.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_THREADS_REALTIME_THREAD_HPP_
#define TAKT_SCHED_THREADS_REALTIME_THREAD_HPP_

#include <functional>
#include <thread>

#include "takt/base/visibility.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_PUBLIC takt {

/// Starts a thread, gives it its attributes in the thread itself, touches its stack if the policy
/// is a real-time one (others may meet page faults, and keep their memory), and only then calls
/// `body`. The constructor returns when the attributes are in force, and throws the Error when they
/// were refused and are required. The destructor joins.
///
/// Thread safety: an object belongs to the thread that made it.
/// Real-time: set-up and tear-down only.
class RealtimeThread {
 public:
  RealtimeThread(const ThreadAttributes& attributes, Realtime realtime, std::function<void()> body);
  ~RealtimeThread() { join(); }
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  /// The attributes that the kernel granted.
  const ThreadState& state() const noexcept { return state_; }
  void join() {
    if (thread_.joinable()) thread_.join();
  }

 private:
  ThreadState state_;
  std::thread thread_;
};

}  // namespace takt

#endif  // TAKT_SCHED_THREADS_REALTIME_THREAD_HPP_
