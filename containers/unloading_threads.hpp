// Threads that finish unloading components in the background.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_UNLOADING_THREADS_HPP_
#define TAKT_CONTAINERS_UNLOADING_THREADS_HPP_

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_INTERNAL takt {

/// Threads that wait for the running callbacks of unloaded components. A task gets an idle thread,
/// or a new one if all wait. Threads are kept until destruction: with locked memory, the kernel
/// creates and ends threads in long non-preemptible sections.
/// Thread safety: run() from any thread.
/// Real-time: no.
class UnloadingThreads {
 public:
  UnloadingThreads(ThreadAttributes attributes, Realtime realtime)
      : attributes_(std::move(attributes)), realtime_(realtime) {}
  ~UnloadingThreads();
  UnloadingThreads(const UnloadingThreads&) = delete;
  UnloadingThreads& operator=(const UnloadingThreads&) = delete;

  /// Runs the task on one of the threads; the future is ready when it has returned.
  std::future<void> run(std::function<void()> work);

 private:
  struct Task {
    std::function<void()> work;
    std::promise<void> done;
  };

  void serve();

  const ThreadAttributes attributes_;
  const Realtime realtime_;
  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<Task> tasks_;
  std::size_t unfinished_ = 0;
  bool is_over_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_UNLOADING_THREADS_HPP_
