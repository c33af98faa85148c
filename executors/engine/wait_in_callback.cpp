// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/wait_in_callback.hpp"

#include <mutex>

#include "takt/executors/engine/ready_set.hpp"

namespace takt {
namespace {

PiMutex& waits_mutex() noexcept {
  static PiMutex mutex;
  return mutex;
}

bool is_inside(const Dispatch* dispatch, const CallbackRecord& record) noexcept {
  for (; dispatch != nullptr; dispatch = dispatch->outer) {
    if (record.is_described_by(dispatch->callback)) return true;
  }
  return false;
}

}  // namespace

constinit WaitInCallback* WaitInCallback::first_ = nullptr;
constinit std::atomic<std::uint32_t> WaitInCallback::moves_{0};

// What is known has no circle, so this ends.
bool WaitInCallback::leads_here(const CallbackRecord& record) noexcept {
  if (is_inside(Dispatch::current(), record)) return true;
  for (const WaitInCallback* wait = first_; wait != nullptr; wait = wait->next_) {
    if (is_inside(wait->inside_, record) && leads_here(wait->until_)) return true;
  }
  return false;
}

WaitInCallback::WaitInCallback(const CallbackRecord& until) noexcept
    : until_(until), inside_(Dispatch::current()) {
  const std::lock_guard lock(waits_mutex());
  is_for_itself_ = leads_here(until);
  if (!is_for_itself_) next_ = std::exchange(first_, this);
}

WaitInCallback::~WaitInCallback() {
  if (is_for_itself_) return;
  const std::lock_guard lock(waits_mutex());
  WaitInCallback** link = &first_;
  while (*link != this) link = &(*link)->next_;
  *link = next_;
}

}  // namespace takt
