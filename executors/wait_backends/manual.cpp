// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/wait_backends/manual.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"

namespace takt {
namespace {

CpuModel::Policy policy_of(ThreadPolicy policy) {
  using Policy = CpuModel::Policy;
  switch (policy) {
    case ThreadPolicy::fifo:
      return Policy::fifo;
    case ThreadPolicy::rr:
      return Policy::rr;
    case ThreadPolicy::deadline:
      return Policy::deadline;
    case ThreadPolicy::idle:
      return Policy::idle;
    case ThreadPolicy::other:
    case ThreadPolicy::batch:
      break;
  }
  return Policy::other;
}

}  // namespace

ManualWaitBackend::ManualWaitBackend(ManualClock& clock, std::size_t workers)
    : clock_(clock), workers_(workers) {
  static std::atomic<std::uint64_t> backends{0};
  const std::uint64_t backend = backends.fetch_add(1);
  for (std::size_t i = 0; i < workers; ++i) workers_[i].participant.rank = {backend, i};
}

void ManualWaitBackend::enter(std::size_t worker, const ThreadAttributes& thread) noexcept {
  Worker& self = workers_[worker];
  self.participant.name = thread.name;
  CpuModel::Thread& on_cpus = self.participant.thread;
  on_cpus.policy = policy_of(thread.policy);
  on_cpus.priority = thread.priority;
  on_cpus.nice = thread.nice;
  on_cpus.reservation = {thread.runtime, thread.deadline, thread.period};
  on_cpus.cpus = thread.affinity;
  clock_.join(self.participant);
  self.joined = true;
}

void ManualWaitBackend::leave(std::size_t worker) noexcept {
  if (std::exchange(workers_[worker].joined, false)) clock_.leave(workers_[worker].participant);
}

bool ManualWaitBackend::wait(std::size_t worker, TimePoint deadline) noexcept {
  Worker& self = workers_[worker];
  {
    const std::lock_guard lock(mutex_);
    if (posts_ != 0) return --posts_, true;
    self.sleeping = true;
  }
  // The caller of spin_once controls the clock until it has to wait.
  if (!self.joined) enter(worker, {});
  const bool woken = clock_.wait(self.participant, deadline);
  const std::lock_guard lock(mutex_);
  self.sleeping = false;
  if (!woken && posts_ != 0) return --posts_, true;
  return woken;
}

void ManualWaitBackend::search(std::size_t worker, TimePoint deadline) noexcept {
  if (!workers_[worker].joined) enter(worker, {});
  clock_.search(workers_[worker].participant, deadline);
}

void ManualWaitBackend::post() noexcept {
  const std::lock_guard lock(mutex_);
  const auto sleeper = std::find_if(workers_.begin(), workers_.end(),
                                    [](const Worker& worker) { return worker.sleeping; });
  if (sleeper == workers_.end()) {
    ++posts_;
  } else {
    sleeper->sleeping = false;
    clock_.wake(sleeper->participant);
  }
}

void ManualWaitBackend::watch(const Watch& watch) {
  const std::lock_guard lock(watches_mutex_);
  watches_.push_back(watch);
}

void ManualWaitBackend::unwatch(const ArrivalListener* listener) noexcept {
  const std::lock_guard lock(watches_mutex_);
  std::erase_if(watches_, [&](const Watch& watch) { return watch.listener == listener; });
}

// The listener asks the descriptor itself.
bool ManualWaitBackend::look() noexcept {
  const std::lock_guard lock(watches_mutex_);
  const ReadSection section;
  for (const Watch& watch : watches_) watch.listener->announce({next_sequence(), clock_.now()});
  return !watches_.empty();
}

}  // namespace takt
