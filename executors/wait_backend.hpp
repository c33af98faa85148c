// How executor threads sleep and are woken.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WAIT_BACKEND_HPP_
#define TAKT_EXECUTORS_WAIT_BACKEND_HPP_

#include <cstddef>
#include <memory>

#include "takt/base/clock.hpp"

namespace takt {

/// A semaphore with a deadline: a post is never lost, and wakes one worker.
/// Thread safety: post from any thread; wait from the worker of that index.
/// Real-time: post is one system call when somebody sleeps; nothing allocates after construction.
class WaitBackend {
 public:
  virtual ~WaitBackend() = default;
  /// Sleeps until somebody posts (true) or the deadline has come (false).
  virtual bool wait(std::size_t worker, TimePoint deadline) noexcept = 0;
  virtual void post() noexcept = 0;
  /// The calling thread is that worker from here until it leaves.
  virtual void enter(std::size_t) {}
  virtual void leave(std::size_t) noexcept {}
};

/// `futex` for CLOCK_MONOTONIC, `manual` for a manual clock: fixed when the executor is made.
std::unique_ptr<WaitBackend> make_wait_backend(Clock& clock, std::size_t workers);

}  // namespace takt

#endif  // TAKT_EXECUTORS_WAIT_BACKEND_HPP_
