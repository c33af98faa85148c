// Threads that unload components.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LOADERS_HPP_
#define TAKT_CONTAINERS_LOADERS_HPP_

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {

/// Threads that wait for the callbacks of unloaded components: one, and one more for each that
/// still waits. They stay, because to make and end a thread is work that the kernel does not
/// interrupt while memory is locked.
class Loaders {
 public:
  Loaders(ThreadAttributes attributes, Realtime realtime)
      : attributes_(std::move(attributes)), realtime_(realtime) {}
  ~Loaders();
  Loaders(const Loaders&) = delete;
  Loaders& operator=(const Loaders&) = delete;

  /// The result is there when the thread is free again.
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

#endif  // TAKT_CONTAINERS_LOADERS_HPP_
