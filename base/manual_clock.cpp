// SPDX-License-Identifier: Apache-2.0
#include "takt/base/manual_clock.hpp"

#include <algorithm>

namespace takt {
namespace {

// The calling thread's participant, which work() blocks.
thread_local ManualClock::Participant* this_participant = nullptr;
thread_local bool is_counted_elsewhere = false;

CpuModel::Options of_speed_1(const std::vector<int>& numbers) {
  CpuModel::Options options;
  for (const int number : numbers) options.cpus.push_back({.number = number});
  return options;
}

}  // namespace

ManualClock::ManualClock(TimePoint start, CpuModel::Options cpus) : now_(start) {
  if (!cpus.cpus.empty()) cpus_.emplace(std::move(cpus));
}

ManualClock::ManualClock(TimePoint start, const std::vector<int>& cpus)
    : ManualClock(start, of_speed_1(cpus)) {
}

// Only the thread that holds the baton moves it.
TimePoint ManualClock::now() const noexcept {
  return now_.load(std::memory_order_acquire);
}

// ---- What happens next ----

TimePoint ManualClock::next_event(const Participant& participant) const noexcept {
  if (!cpus_ || participant.state_ == State::sleeping) return participant.wake_time_;
  const TimePoint next = cpus_->next_event(participant.thread);
  return participant.state_ == State::searching ? std::min(next, participant.wake_time_) : next;
}

// Something happens to the participant at the present time. True: it goes on now.
bool ManualClock::happen(Participant& participant) noexcept {
  if (!cpus_) return true;
  if (participant.state_ == State::sleeping) {
    participant.state_ = State::working;
    cpus_->wake(participant.thread, now());
    return false;
  }
  if (participant.state_ == State::searching && participant.wake_time_ <= now()) {
    participant.state_ = State::working;  // perhaps it has no CPU now
    cpus_->end_work(participant.thread, now());
    return false;
  }
  return cpus_->happen(participant.thread, now());
}

// The participant that runs next; nullptr: none before target_. At one instant, participants that
// finish their work come first, so that nobody preempts them; then the others, in the order of
// their ranks; then CPUs.
ManualClock::Participant* ManualClock::step() noexcept {
  for (;;) {
    if (stops_ != nullptr && stops_->load(std::memory_order_relaxed)) {
      target_ = now();
      return nullptr;
    }
    Participant* first = nullptr;
    TimePoint time = kNever;
    for (Participant* candidate : participants_) {
      const TimePoint event = next_event(*candidate);
      const bool ends = cpus_ && candidate->state_ == State::working;
      if (event > time || event == kNever) continue;
      if (event == time && (!ends || first->state_ == State::working)) continue;
      first = candidate;
      time = event;
    }
    const TimePoint of_cpus = cpus_ ? cpus_->next_event() : kNever;
    const TimePoint next = std::min(time, of_cpus);
    if (next == kNever || next > target_) return nullptr;
    if (next > now()) now_.store(next, std::memory_order_release);
    if (of_cpus < time) {
      cpus_->happen(next);
    } else if (happen(*first)) {
      return first;
    }
  }
}

// `self` has the baton; nullptr: the controller, or a participant that leaves, passes it on. If
// this returns without the lock, another participant has the baton.
void ManualClock::pass_on(Participant* self, std::unique_lock<std::mutex>& lock) noexcept {
  running_ = step();
  if (running_ == nullptr) {
    is_advancing_ = false;
    controller_.notify_all();
    return;
  }
  running_->state_ = State::running;
  if (running_ == self) return;
  Participant& next = *running_;
  lock.unlock();  // first, as the next thread needs the mutex
  next.has_baton_.store(1);
  next.has_baton_.notify_one();  // only the address is used: `next` may be gone
}

void ManualClock::advance(Nanoseconds duration, const std::atomic<bool>* stops) {
  std::unique_lock lock(mutex_);
  controller_.wait(lock, [this] { return !is_advancing_; });
  target_ = later(now(), duration);
  stops_ = stops;
  is_advancing_ = true;
  pass_on(nullptr, lock);
  if (!lock.owns_lock()) lock.lock();
  controller_.wait(lock, [this] { return !is_advancing_; });
  if (target_ > now()) now_.store(target_);
}

void ManualClock::end_by(TimePoint time) noexcept {
  const std::lock_guard lock(mutex_);
  target_ = std::min(target_, time);
}

void ManualClock::wait_for_participants(std::size_t count) {
  std::unique_lock lock(mutex_);
  controller_.wait(lock, [&] { return participants_.size() >= count; });
}

// ---- Participants ----

// When a thread whose sleep ends at `time` goes on.
TimePoint ManualClock::after_wake_up(TimePoint time) const noexcept {
  return cpus_ ? later(time, cpus_->wake_overhead()) : time;
}

// The thread waits in this state until it has the baton.
void ManualClock::block(Participant& self, State state,
                        std::unique_lock<std::mutex>& lock) noexcept {
  self.state_ = state;
  if (running_ == &self) {
    pass_on(&self, lock);
    if (lock.owns_lock() && running_ == &self) return;
  }
  if (lock.owns_lock()) lock.unlock();
  self.has_baton_.wait(0);
  self.has_baton_.store(0);
}

void ManualClock::join(Participant& self) {
  std::unique_lock lock(mutex_);
  const auto place =
      std::find_if(participants_.begin(), participants_.end(),
                   [&](const Participant* other) { return self.rank < other->rank; });
  participants_.insert(place, &self);
  this_participant = &self;
  self.wake_time_ = now();
  controller_.notify_all();
  block(self, State::sleeping, lock);
}

void ManualClock::leave(Participant& self) noexcept {
  std::unique_lock lock(mutex_);
  std::erase(participants_, &self);
  if (cpus_ && self.thread.is_awake()) cpus_->sleep(self.thread, now());
  self.state_ = State::absent;
  self.token_ = false;
  this_participant = nullptr;
  if (running_ == &self) pass_on(nullptr, lock);
}

bool ManualClock::wait(Participant& self, TimePoint deadline) noexcept {
  std::unique_lock lock(mutex_);
  if (!self.token_) {
    if (deadline <= now()) return false;
    self.wake_time_ = after_wake_up(deadline);
    if (cpus_) cpus_->sleep(self.thread, now());
    block(self, State::sleeping, lock);
    if (!lock.owns_lock()) lock.lock();
  }
  return std::exchange(self.token_, false);
}

bool ManualClock::search(Participant& self, TimePoint deadline) noexcept {
  if (!cpus_) return wait(self, deadline);
  std::unique_lock lock(mutex_);
  if (!self.token_) {
    if (deadline <= now()) return false;
    self.wake_time_ = deadline;
    cpus_->occupy(self.thread, Nanoseconds::max(), now());
    block(self, State::searching, lock);
    if (!lock.owns_lock()) lock.lock();
  }
  return std::exchange(self.token_, false);
}

void ManualClock::wake(Participant& self) noexcept {
  const std::lock_guard lock(mutex_);
  if (std::exchange(self.token_, true)) return;
  if (self.state_ == State::searching) self.wake_time_ = now();
  if (self.state_ == State::sleeping)
    self.wake_time_ = std::min(self.wake_time_, after_wake_up(now()));
}

ManualClock::CountedElsewhere::CountedElsewhere() noexcept {
  is_counted_elsewhere = true;
}

ManualClock::CountedElsewhere::~CountedElsewhere() {
  is_counted_elsewhere = false;
}

std::vector<ManualClock::Use> ManualClock::use() const {
  const std::lock_guard lock(mutex_);
  std::vector<Use> result;
  for (const Participant* participant : participants_)
    result.push_back({participant->name, participant->thread.used(now()), &participant->thread});
  return result;
}

const CpuModel::Thread* ManualClock::this_thread() noexcept {
  return this_participant != nullptr ? &this_participant->thread : nullptr;
}

void ManualClock::work(Nanoseconds duration) {
  spend(duration, true);
}

void ManualClock::occupy(Nanoseconds duration) {
  spend(duration, false);
}

void ManualClock::spend(Nanoseconds duration, bool is_work) {
  if (is_counted_elsewhere) return;
  std::unique_lock lock(mutex_);
  Participant* const self = this_participant;
  if (self == nullptr) {
    now_.store(later(now(), duration));
    return;
  }
  if (cpus_) {
    is_work ? cpus_->work(self->thread, duration, now())
            : cpus_->occupy(self->thread, duration, now());
  } else {
    self->wake_time_ = later(now(), duration);
  }
  block(*self, State::working, lock);
}

}  // namespace takt
