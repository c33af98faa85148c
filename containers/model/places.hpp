// The CPU time that the threads of a system get.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_PLACES_HPP_
#define TAKT_CONTAINERS_MODEL_PLACES_HPP_

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/analysis/system.hpp"
#include "takt/base/visibility.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_INTERNAL takt {

/// A thread of an executor.
struct ModelledThread {
  std::size_t executor = 0;     // several threads may belong to one
  ThreadAttributes attributes;  // of a band: of its lowest thread
  int highest = 0;              // of a band: its highest priority; 0: no band
};

/// The CPU time that an executor's threads get.
struct Place {
  std::optional<analysis::Reservation> reservation;
  std::optional<analysis::Executor::Share> share;
  /// The CPU that all of its threads are bound to; -1: none.
  int cpu = -1;
  /// Executors whose threads may push one of its threads to another CPU, of which one is always
  /// free.
  std::vector<std::size_t> movers;
  std::string unknown;  // why no bound is known; empty: one is
};

/// The places by executor. A thread without real-time priority has a supply only if nothing else
/// runs on the machine, and there is a CPU for each thread.
/// Thread safety: a pure function. Real-time: no.
std::vector<Place> find_places(std::span<const ModelledThread> threads, std::size_t executors,
                               const std::vector<int>& cpus, bool is_exclusive);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_PLACES_HPP_
