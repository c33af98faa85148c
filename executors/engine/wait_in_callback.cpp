// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/wait_in_callback.hpp"

#include <mutex>

#include "takt/base/never_destroyed.hpp"
#include "takt/executors/engine/ready_set.hpp"

namespace takt::detail {
namespace {

PiMutex& waits_mutex() noexcept {
  static NeverDestroyed<PiMutex> mutex;
  return *mutex;
}

bool is_inside(const Dispatch* dispatch, const CallbackRecord& record) noexcept {
  for (; dispatch != nullptr; dispatch = dispatch->outer) {
    if (record.is_described_by(dispatch->callback)) return true;
  }
  return false;
}

}  // namespace

constinit WaitInCallback* WaitInCallback::first_ = nullptr;
constinit std::atomic<std::uint32_t> WaitInCallback::progress_{0};

// The known waits form no cycle, so this ends.
bool WaitInCallback::closes_cycle(const CallbackRecord& record) noexcept {
  if (is_inside(Dispatch::current(), record)) return true;
  for (const WaitInCallback* wait = first_; wait != nullptr; wait = wait->next_) {
    if (is_inside(wait->inside_, record) && closes_cycle(wait->until_)) return true;
  }
  return false;
}

WaitInCallback::WaitInCallback(const CallbackRecord& until) noexcept
    : until_(until), inside_(Dispatch::current()) {
  const std::lock_guard lock(waits_mutex());
  is_for_itself_ = closes_cycle(until);
  if (!is_for_itself_) next_ = std::exchange(first_, this);
}

WaitInCallback::~WaitInCallback() {
  if (is_for_itself_) return;
  const std::lock_guard lock(waits_mutex());
  WaitInCallback** link = &first_;
  while (*link != this) link = &(*link)->next_;
  *link = next_;
}

}  // namespace takt::detail
