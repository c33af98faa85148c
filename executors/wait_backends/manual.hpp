// How workers sleep under a manual clock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WAIT_BACKENDS_MANUAL_HPP_
#define TAKT_EXECUTORS_WAIT_BACKENDS_MANUAL_HPP_

#include <mutex>
#include <vector>

#include "takt/base/manual_clock.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt {

/// Each worker is a participant of the manual clock. A post goes to the sleeper with the lowest
/// index, so that a run is deterministic. A worker polls the file descriptors when it looks; one
/// that becomes ready wakes nobody, because only the clock does.
/// Thread safety: as WaitBackend.
/// Real-time: no; for tests and simulation only.
class ManualWaitBackend final : public WaitBackend {
 public:
  ManualWaitBackend(ManualClock& clock, std::size_t workers);

  void enter(std::size_t worker, const ThreadAttributes& thread) noexcept override;
  void leave(std::size_t worker) noexcept override;
  bool wait(std::size_t worker, TimePoint deadline) noexcept override;
  /// A worker that spins keeps its CPU. No post wakes it, but a call.
  void search(std::size_t worker, TimePoint deadline) noexcept;
  void call(std::size_t worker) noexcept { clock_.wake(workers_[worker].participant); }
  void post() noexcept override;

  bool serves_file_descriptors() const noexcept override { return true; }
  void watch(const Watch& watch) override;
  void unwatch(const ArrivalListener* listener) noexcept override;
  bool look() noexcept override;

 private:
  struct Worker {
    ManualClock::Participant participant;
    bool joined = false;
    bool sleeping = false;
  };

  ManualClock& clock_;
  std::mutex mutex_;  // guards posts_ and workers_
  std::size_t posts_ = 0;
  std::vector<Worker> workers_;
  std::mutex watches_mutex_;
  std::vector<Watch> watches_;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_WAIT_BACKENDS_MANUAL_HPP_
