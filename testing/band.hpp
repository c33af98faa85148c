// Threads of an executor whose callbacks interrupt each other.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_BAND_HPP_
#define TAKT_TESTING_BAND_HPP_

#include <vector>

#include "takt/base/available_cpus.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {

/// One for each priority from 60 on, on the first CPU.
inline std::vector<ThreadAttributes> band_of(std::size_t levels) {
  std::vector<ThreadAttributes> threads(levels);
  for (std::size_t i = 0; i < levels; ++i) {
    threads[i].policy = ThreadPolicy::fifo;
    threads[i].priority = 60 + static_cast<int>(i);
    threads[i].affinity = {available_cpus().front()};
  }
  return threads;
}

}  // namespace takt

#endif  // TAKT_TESTING_BAND_HPP_
