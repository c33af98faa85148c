// SPDX-License-Identifier: Apache-2.0
#include "takt/base/manual_clock.hpp"

#include <algorithm>
#include <tuple>

namespace takt {
namespace {
// The participant that the calling thread is, so that work() knows which one to block.
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
    if (candidate->is_awake_ && !candidate->has_cpu_) continue;
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
  const TimePoint target = later(now_, duration);
  for (;;) {
    if (!cpus_.empty()) share_cpus();
    Participant* next = next_due(target);
    if (next == nullptr) break;
    if (!(next->wakeable_ && next->token_)) now_ = std::max(now_, next->wake_time_);
    if (!cpus_.empty() && !next->has_cpu_) {  // it wakes up, and gets a CPU or waits for one
      next->is_awake_ = true;
      next->awake_since_ = now_;
      next->remaining_ = Nanoseconds::zero();
      continue;
    }
    next->state_ = Participant::State::running;
    running_ = next;
    next->released_.notify_one();
    baton_back_.wait(lock, [&] { return running_ == nullptr; });
  }
  now_ = std::max(now_, target);
}

// Takes the CPUs from all, and gives them to the most urgent of those that are awake.
void ManualClock::share_cpus() {
  std::vector<Participant*> awake;
  for (Participant* candidate : participants_) {
    if (candidate->state_ != Participant::State::blocked || !candidate->is_awake_) continue;
    if (std::exchange(candidate->has_cpu_, false))
      candidate->remaining_ = candidate->wake_time_ - now_;
    candidate->wake_time_ = kNever;
    awake.push_back(candidate);
  }
  std::stable_sort(awake.begin(), awake.end(), [](const Participant* a, const Participant* b) {
    const auto urgency = [](const Participant* candidate) {
      const bool has_deadline = candidate->deadline != Nanoseconds::zero();
      return std::tuple(has_deadline ? candidate->awake_since_ + candidate->deadline : kNever,
                        -candidate->priority, candidate->awake_since_);
    };
    return urgency(a) < urgency(b);
  });
  std::vector<int> free = cpus_;
  for (Participant* candidate : awake) {
    const auto cpu = std::find_if(free.begin(), free.end(), [&](int number) {
      return candidate->cpus.empty() || std::find(candidate->cpus.begin(), candidate->cpus.end(),
                                                  number) != candidate->cpus.end();
    });
    if (cpu == free.end()) continue;
    free.erase(cpu);
    candidate->has_cpu_ = true;
    candidate->wake_time_ = later(now_, candidate->remaining_);
  }
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
  const auto place =
      std::find_if(participants_.begin(), participants_.end(),
                   [&](const Participant* other) { return self.rank < other->rank; });
  participants_.insert(place, &self);
  this_participant = &self;
  self.wakeable_ = self.is_awake_ = self.has_cpu_ = false;
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
    self.is_awake_ = self.has_cpu_ = false;
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
    now_ = later(now_, duration);
    return;
  }
  this_participant->wake_time_ = later(now_, duration);
  this_participant->remaining_ = duration;
  block(*this_participant, lock);
}

}  // namespace takt
