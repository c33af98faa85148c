// Waits for entities without an executor.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WAIT_SET_HPP_
#define TAKT_EXECUTORS_WAIT_SET_HPP_

#include <atomic>
#include <memory>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"
#include "takt/executors/wait_backends/sleepers.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"

namespace TAKT_PUBLIC takt {

/// For a loop in user code, like rclcpp::WaitSet: wait until an entity is ready, then take from the
/// entities in any order. It is level-triggered: an entity stays ready until everything is taken.
/// An entity is in one wait set or executor at a time; the set holds it until it is removed.
///
/// Thread safety: one thread waits; entities may become ready, be added and removed on any.
/// Real-time: wait sleeps in epoll, so that file descriptors can come at any time, and neither
/// polls nor allocates; with a manual clock file descriptors do not wake it.
class WaitSet {
 public:
  explicit WaitSet(Clock& clock = Clock::steady());
  ~WaitSet();
  WaitSet(const WaitSet&) = delete;
  WaitSet& operator=(const WaitSet&) = delete;

  /// What is added counts at once, also for a thread that waits already. Throws Error when the
  /// entity belongs to an executor or another wait set.
  void add(const std::shared_ptr<Entity>& entity);
  void remove(const std::shared_ptr<Entity>& entity);

  /// Sleeps until an entity is ready or the timeout has passed (negative: for ever). The result
  /// lists what is ready, in the order of add; it is empty after a timeout, and valid until the
  /// next call.
  const std::vector<std::shared_ptr<Entity>>& wait(Nanoseconds timeout = Nanoseconds(-1));

 private:
  struct Member;
  void wake() noexcept;
  void expel(Member& member) noexcept;
  void collect();

  Clock& clock_;
  const std::unique_ptr<WaitBackend> backend_;
  detail::Sleepers sleeper_;  // the thread that waits
  std::atomic<std::size_t> expected_removals_{0};
  mutable RankedMutex<LockRank::wait_set> mutex_;  // guards members_
  std::vector<std::unique_ptr<Member>> members_;
  std::vector<std::shared_ptr<Entity>> ready_;
  std::vector<std::shared_ptr<Entity>> larger_;  // guarded by mutex_: room for the next result
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_WAIT_SET_HPP_
