// SPDX-License-Identifier: Apache-2.0
#include "takt/base/manual_clock.hpp"

#include <algorithm>

namespace takt {
namespace {
// The participant that the calling thread is, so that work() knows whom to block.
thread_local ManualClock::Participant* this_participant = nullptr;
}  // namespace

TimePoint ManualClock::now() const noexcept {
  const std::lock_guard lock(mutex_);
  return now_;
}

ManualClock::Participant* ManualClock::next_due(TimePoint limit) noexcept {
  Participant* first = nullptr;
  TimePoint first_time = limit;
  for (Participant* candidate : participants_) {
    if (candidate->state_ != Participant::State::blocked) continue;
    const bool woken = candidate->wakeable_ && candidate->token_;
    const TimePoint time = woken ? now_ : candidate->wake_time_;
    if (time < first_time || (first == nullptr && time <= limit && time != kNever)) {
      first = candidate;
      first_time = time;
    }
  }
  return first;
}

void ManualClock::advance(Nanoseconds duration) {
  std::unique_lock lock(mutex_);
  const TimePoint target = now_ + duration;
  while (Participant* next = next_due(target)) {
    if (!(next->wakeable_ && next->token_)) now_ = std::max(now_, next->wake_time_);
    next->state_ = Participant::State::running;
    running_ = next;
    next->released_.notify_one();
    baton_back_.wait(lock, [&] { return running_ == nullptr; });
  }
  now_ = std::max(now_, target);
}

void ManualClock::wait_for_participants(std::size_t count) {
  std::unique_lock lock(mutex_);
  baton_back_.wait(lock, [&] { return participants_.size() >= count; });
}

void ManualClock::block(Participant& self, std::unique_lock<std::mutex>& lock) noexcept {
  self.state_ = Participant::State::blocked;
  if (running_ == &self) running_ = nullptr;
  baton_back_.notify_all();
  self.released_.wait(lock, [&] { return self.state_ == Participant::State::running; });
}

void ManualClock::join(Participant& self) {
  std::unique_lock lock(mutex_);
  const auto place = std::find_if(participants_.begin(), participants_.end(),
                                  [&](const Participant* other) { return self.rank < other->rank; });
  participants_.insert(place, &self);
  this_participant = &self;
  self.wakeable_ = false;
  self.wake_time_ = now_;
  block(self, lock);
}

void ManualClock::leave(Participant& self) noexcept {
  const std::lock_guard lock(mutex_);
  std::erase(participants_, &self);
  self.state_ = Participant::State::absent;
  self.token_ = false;
  if (running_ == &self) running_ = nullptr;
  this_participant = nullptr;
  baton_back_.notify_all();
}

bool ManualClock::wait(Participant& self, TimePoint deadline) noexcept {
  std::unique_lock lock(mutex_);
  if (!self.token_) {
    if (deadline <= now_) return false;
    self.wake_time_ = deadline;
    self.wakeable_ = true;
    block(self, lock);
    self.wakeable_ = false;
  }
  return std::exchange(self.token_, false);
}

void ManualClock::wake(Participant& self) noexcept {
  const std::lock_guard lock(mutex_);
  self.token_ = true;
}

void ManualClock::work(Nanoseconds duration) {
  std::unique_lock lock(mutex_);
  if (this_participant == nullptr) {
    now_ += duration;
    return;
  }
  this_participant->wake_time_ = now_ + duration;
  block(*this_participant, lock);
}

}  // namespace takt
