// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/wait_in_callback.hpp"

#include <mutex>

#include "takt/base/never_destroyed.hpp"

namespace takt::detail {
namespace {

PiMutex& waits_mutex() noexcept {
  static NeverDestroyed<PiMutex> mutex;
  return *mutex;
}

}  // namespace

thread_local constinit const Running* Running::innermost_ = nullptr;
constinit WaitInCallback* WaitInCallback::first_ = nullptr;
constinit std::atomic<std::uint32_t> WaitInCallback::progress_{0};
constinit std::atomic<WaitInCallback::Duty> WaitInCallback::duty_{nullptr};

bool WaitInCallback::Inside::has(const Awaited& awaited) const noexcept {
  if (awaited.describes == nullptr) {
    for (const Running* each = running; each != nullptr; each = each->outer_) {
      if (each->what_ == awaited.what) return true;
    }
    return false;
  }
  for (const Dispatch* each = dispatch; each != nullptr; each = each->outer) {
    if (awaited.describes(awaited.what, each->callback)) return true;
  }
  return false;
}

bool WaitInCallback::closes_cycle(const Inside& own, const Awaited& until) noexcept {
  return own.has(until) || others_wait_for(own, until);
}

// The recursion ends: known waits form no cycle, except for a thread that waits for what it runs
// itself.
bool WaitInCallback::others_wait_for(const Inside& own, const Awaited& until) noexcept {
  for (const WaitInCallback* wait = first_; wait != nullptr; wait = wait->next_) {
    if (wait->inside_.has(until) && wait->until_ != until && closes_cycle(own, wait->until_)) {
      return true;
    }
  }
  return false;
}

WaitInCallback::WaitInCallback(const Awaited& until, Whose whose) noexcept
    : until_(until), inside_{Dispatch::current(), Running::innermost()} {
  const std::lock_guard lock(waits_mutex());
  is_for_itself_ = (whose == Whose::all && inside_.has(until_)) || others_wait_for(inside_, until_);
  if (is_for_itself_) return;
  next_ = std::exchange(first_, this);
  notify_progress();  // is_anyone_waiting_in may be true now
}

bool WaitInCallback::is_anyone_waiting_in(const void* running) noexcept {
  const std::lock_guard lock(waits_mutex());
  for (const WaitInCallback* wait = first_; wait != nullptr; wait = wait->next_) {
    if (wait->inside_.has({running, nullptr})) return true;
  }
  return false;
}

WaitInCallback::~WaitInCallback() {
  if (is_for_itself_) return;
  const std::lock_guard lock(waits_mutex());
  WaitInCallback** link = &first_;
  while (*link != this) link = &(*link)->next_;
  *link = next_;
}

}  // namespace takt::detail
