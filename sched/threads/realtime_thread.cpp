// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/realtime_thread.hpp"

#include <future>

#include "takt/sched/threads/memory_lock.hpp"

namespace takt {

RealtimeThread::RealtimeThread(const ThreadAttributes& attributes, Realtime realtime,
                               std::function<void()> body) {
  std::promise<ThreadState> in_force;
  std::future<ThreadState> state = in_force.get_future();
  thread_ = std::thread([&in_force, attributes, realtime, body = std::move(body)]() mutable {
    // Moved: the constructor that owns the promise returns as soon as the value is set.
    std::promise<ThreadState> promise = std::move(in_force);
    try {
      const ThreadState granted = apply(attributes, realtime);
      if (is_realtime(granted.policy)) prefault_stack();
      promise.set_value(granted);
    } catch (...) {
      promise.set_exception(std::current_exception());
      return;
    }
    body();
  });
  try {
    state_ = state.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

}  // namespace takt
