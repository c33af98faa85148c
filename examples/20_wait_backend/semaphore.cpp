// A wait back end: threads sleep in a POSIX semaphore. File descriptors are for others.
// SPDX-License-Identifier: Apache-2.0
#include <ctime>

#include <semaphore.h>

#include "takt/executors/wait_backends/wait_backend.hpp"
using namespace takt;

class Semaphore final : public WaitBackend {
 public:
  explicit Semaphore(std::size_t) { sem_init(&semaphore_, 0, 0); }
  ~Semaphore() override { sem_destroy(&semaphore_); }

  bool wait(std::size_t, TimePoint deadline) noexcept override {
    if (deadline == kNever) return sem_wait(&semaphore_) == 0;
    const auto time = deadline.time_since_epoch();
    const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
    const timespec end{seconds.count(), (time - seconds).count()};
    return sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &end) ==
           0;  // false: then it is called again
  }
  void post() noexcept override { sem_post(&semaphore_); }

 private:
  sem_t semaphore_;
};
TAKT_REGISTER_WAIT_BACKEND("semaphore", "POSIX semaphores; no file descriptors", Semaphore)
