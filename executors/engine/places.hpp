// Where the workers of an executor sleep, and are woken.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_PLACES_HPP_
#define TAKT_EXECUTORS_ENGINE_PLACES_HPP_

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include "takt/executors/engine/record.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/sleepers.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace takt::detail {

/// Workers that can replace each other sleep in one place, a wait back end; with a workers' policy
/// each worker has a place of its own. Each place also watches the file descriptors. Thread safety:
/// as the sections say. Real-time: only the first section allocates.
class Places {
 public:
  Places(const ExecutorOptions& options, std::size_t workers, bool are_told_apart);

  // ---- Control threads ----

  /// Whether the back ends exist: from construction on if the options name one, else from the first
  /// spin on.
  bool are_chosen() const noexcept { return places_.front().backend != nullptr; }
  void choose(bool has_file_descriptors);
  void prepare();
  void forget() noexcept;
  /// Watches the record's file descriptor, if it has one and the back ends are chosen.
  void watch(CallbackRecord& record);
  void unwatch(CallbackRecord& record) noexcept;

  // ---- Workers ----

  WaitBackend& backend_of(std::size_t worker) noexcept { return *place_of(worker).backend; }
  Sleepers& sleepers_of(std::size_t worker) noexcept { return place_of(worker).sleepers; }
  const Sleepers& sleepers_of(std::size_t worker) const noexcept {
    return places_[places_.size() == 1 ? 0 : worker].sleepers;
  }
  bool watch_file_descriptors() const noexcept {
    return watched_.load(std::memory_order_relaxed) != 0;
  }
  /// Polls the file descriptors and announces the ready ones. Returns true if there was one.
  [[gnu::noinline]] bool look() noexcept;

  // ---- Any thread ----

  /// Wakes the first of these workers that sleeps. False: none does, or all were woken.
  bool wake_one_of(WorkerSet workers) noexcept;
  void wake_all() noexcept;

 private:
  struct Place {
    Sleepers sleepers;
    std::unique_ptr<WaitBackend> backend;

    bool wake() noexcept {
      return sleepers.wake([this] { backend->post(); });
    }
  };
  Place& place_of(std::size_t worker) noexcept { return places_[places_.size() == 1 ? 0 : worker]; }

  const ExecutorOptions& options_;
  const std::size_t workers_;
  std::vector<Place> places_;
  std::atomic<std::size_t> watched_{0};  // file descriptors
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_PLACES_HPP_
