// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/unloading_threads.hpp"

#include <exception>

namespace takt {

UnloadingThreads::~UnloadingThreads() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

std::future<void> UnloadingThreads::run(std::function<void()> work) {
  Task task{std::move(work), {}};
  std::future<void> done = task.done.get_future();
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
    if (threads_.size() < ++unfinished_) threads_.emplace_back([this] { serve(); });
  }
  changed_.notify_one();
  return done;
}

void UnloadingThreads::serve() {
  apply(attributes_, realtime_);
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_over_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    std::exception_ptr exception;
    try {
      task.work();
    } catch (...) {
      exception = std::current_exception();
    }
    task.work = nullptr;
    lock.lock();
    --unfinished_;
    if (exception != nullptr) {
      task.done.set_exception(exception);
    } else {
      task.done.set_value();
    }
  }
}

}  // namespace takt
