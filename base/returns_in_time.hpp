// Tries code of a user that may never return.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_RETURNS_IN_TIME_HPP_
#define TAKT_BASE_RETURNS_IN_TIME_HPP_

#include <future>
#include <thread>
#include <utility>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// Runs the function in a thread of its own, and throws what it throws. False: it has not returned
/// by then. Nothing ends such a function: its thread, and what the function has, stays until the
/// process ends. Thread safety: from any thread. Real-time: no.
template <class Function>
bool returns_in_time(Function function, Nanoseconds limit) {
  std::packaged_task<void()> task(std::move(function));
  std::future<void> end = task.get_future();
  std::thread(std::move(task)).detach();
  if (end.wait_for(limit) == std::future_status::timeout) return false;
  end.get();
  return true;
}

}  // namespace takt

#endif  // TAKT_BASE_RETURNS_IN_TIME_HPP_
