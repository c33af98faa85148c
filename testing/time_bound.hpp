// The end of a test that hangs or crashes: it says which program it was.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_TIME_BOUND_HPP_
#define TAKT_TESTING_TIME_BOUND_HPP_

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <unistd.h>

#include "takt/testing/stacks.hpp"

namespace takt {

/// As long as it lives: after `limit`, or on SIGSEGV, the process ends with what `name` says. One
/// at a time.
/// Thread safety: belongs to one thread.
/// Real-time: no.
class TimeBound {
 public:
  TimeBound(std::chrono::seconds limit, std::string name)
      : name_("\nends here: " + std::move(name) + "\n"), thread_([this, limit] {
          std::unique_lock lock(mutex_);
          if (changed_.wait_for(lock, limit, [this] { return is_over_; })) return;
          std::fprintf(stderr, "%shangs for %lld s\n", name_.c_str(),
                       static_cast<long long>(limit.count()));
          stacks::print();
          std::abort();
        }) {
    stacks::prepare();
    running = &name_;
    const auto before = std::signal(SIGSEGV, on_crash);
    if (before != SIG_DFL && before != on_crash) std::signal(SIGSEGV, before);  // a sanitizer's
  }
  ~TimeBound() {
    running = nullptr;
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  TimeBound(const TimeBound&) = delete;
  TimeBound& operator=(const TimeBound&) = delete;

 private:
  static void on_crash(int number) {
    std::signal(number, SIG_DFL);
    if (const std::string* const name = running.load()) {
      [[maybe_unused]] const ssize_t said = write(STDERR_FILENO, name->data(), name->size());
    }
    std::raise(number);
  }

  inline static std::atomic<const std::string*> running{nullptr};
  const std::string name_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_over_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace takt

#endif  // TAKT_TESTING_TIME_BOUND_HPP_
