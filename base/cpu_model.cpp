// SPDX-License-Identifier: Apache-2.0
#include "takt/base/cpu_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using Thread = CpuModel::Thread;
using Policy = CpuModel::Policy;

__extension__ using Wide = __int128;
constexpr Nanoseconds kSecond = std::chrono::seconds(1);
// Work is counted in parts of a nanosecond, so that nothing is rounded when a thread is preempted.
constexpr std::int64_t kParts = 1 << 20;
// Limit: work of a virtual thread without a pause, an hour. At it: it is that long. Seen: nothing.
constexpr std::int64_t kMostWork = INT64_MAX / kParts / 2;

bool is_of_realtime(const Thread& thread) {
  return thread.policy == Policy::fifo || thread.policy == Policy::rr;
}

// Whether threads take turns: under SCHED_RR, and in this model also under the ordinary policies.
bool takes_turns(const Thread& thread) {
  return thread.policy != Policy::fifo && thread.policy != Policy::deadline;
}

// A step of the nice value is a fifth more or less, as in Linux.
Nanoseconds slice_of(const Thread& thread) {
  if (thread.policy == Policy::rr) return CpuModel::kTurn;
  const double usual = 3e6;
  return Nanoseconds(std::llround(usual * std::pow(1.25, -thread.nice)));
}

TimePoint end_of_period(TimePoint due, const Thread& thread) {
  return later(due, thread.reservation.period - thread.reservation.deadline);
}

}  // namespace

CpuModel::CpuModel(Options options) : options_(std::move(options)) {
  if (options_.cpus.empty()) throw Error("there is no virtual CPU", "give at least one");
  for (const Cpu& cpu : options_.cpus) {
    const auto is_same = [&](const Cpu& other) { return other.number == cpu.number; };
    if (std::count_if(options_.cpus.begin(), options_.cpus.end(), is_same) != 1)
      throw Error("virtual CPU " + std::to_string(cpu.number) + " is there twice");
    if (!(cpu.speed >= 0.001 && cpu.speed <= 1000))
      throw Error("the speed of virtual CPU " + std::to_string(cpu.number) + " is not possible",
                  "give one from 0.001 to 1000");
    // Rounded up: no work takes longer than its time divided by the speed.
    states_.push_back({.speed = static_cast<std::int64_t>(std::ceil(cpu.speed * kParts))});
  }
  chosen_.resize(states_.size());
}

// ---- Which thread has which CPU ----

bool CpuModel::may_use(const Thread& thread, std::size_t cpu) const {
  if (is_of_realtime(thread) && states_[cpu].is_throttled) return false;
  return thread.cpus.empty() || thread.policy == Policy::deadline ||
         std::find(thread.cpus.begin(), thread.cpus.end(), options_.cpus[cpu].number) !=
             thread.cpus.end();
}

// The CPU for the thread, among those that have not been given to a more urgent thread.
std::size_t CpuModel::choose(const Thread& thread) const {
  const std::size_t own = thread.policy == Policy::deadline ? thread.last_cpu_ : thread.cpu_;
  if (own != kNone && chosen_[own] == nullptr && may_use(thread, own)) return own;
  std::size_t best = kNone;
  const auto urgency_on = [this](std::size_t cpu) {  // the least urgent thread is last in awake_
    return std::find(awake_.begin(), awake_.end(), states_[cpu].running) - awake_.begin();
  };
  for (std::size_t cpu = 0; cpu < states_.size(); ++cpu) {
    if (chosen_[cpu] != nullptr || !may_use(thread, cpu)) continue;
    const auto rank = [&](std::size_t of) {
      return std::pair(urgency_on(of), of == thread.last_cpu_);
    };
    if (best == kNone || rank(cpu) > rank(best)) best = cpu;
  }
  return best;
}

void CpuModel::share(TimePoint now) {
  account(now);
  std::sort(awake_.begin(), awake_.end(), [](const Thread* a, const Thread* b) {
    const auto urgency = [](const Thread* of) {
      const Policy policy = of->policy == Policy::rr ? Policy::fifo : of->policy;
      return std::tuple(policy, policy == Policy::deadline ? of->due_ : TimePoint{},
                        policy == Policy::fifo ? -of->priority : 0, of->place_);
    };
    return urgency(a) < urgency(b);
  });
  std::fill(chosen_.begin(), chosen_.end(), nullptr);
  for (Thread* thread : awake_) {
    if (thread->is_throttled_) continue;
    if (const std::size_t cpu = choose(*thread); cpu != kNone) chosen_[cpu] = thread;
  }
  for (std::size_t cpu = 0; cpu < states_.size(); ++cpu) {
    Thread* const before = states_[cpu].running;
    if (before == nullptr || before == chosen_[cpu]) continue;
    before->is_preempted_ = before->is_awake_ && !before->is_throttled_;
    before->cpu_ = kNone;
  }
  for (std::size_t cpu = 0; cpu < states_.size(); ++cpu) {
    Thread* const thread = chosen_[cpu];
    Thread* const before = std::exchange(states_[cpu].running, thread);
    if (before == thread) continue;
    if (changes_ != nullptr) {
      const bool was_preempted = before != nullptr && before->is_preempted_;
      changes_->push_back({now, options_.cpus[cpu].number, before, thread, was_preempted});
    }
    if (thread == nullptr) continue;
    if (std::exchange(thread->is_preempted_, false))
      thread->work_ += 2 * options_.change.count() * kParts;
    thread->cpu_ = thread->last_cpu_ = cpu;
    thread->since_ = now;
  }
}

// Charges the running threads for their CPU time. Throttling is per second: a CPU's second is
// renewed when something happens to that CPU.
void CpuModel::account(TimePoint now) {
  for (State& cpu : states_) {
    if (Thread* const thread = cpu.running; thread != nullptr) {
      const Nanoseconds elapsed = now - std::exchange(thread->since_, now);
      // The rest of the last nanosecond counts for the work that follows.
      const std::int64_t speed = speed_of(*thread);
      thread->work_ = std::max(1 - speed, thread->work_ - elapsed.count() * speed);
      thread->budget_ -= elapsed;
      thread->slice_ -= elapsed;
      thread->used_ += elapsed;
      if (is_of_realtime(*thread)) cpu.realtime_used += elapsed;
    }
    if (cpu.second > now || cpu.is_throttled) continue;
    cpu.second = later(now, kSecond - now.time_since_epoch() % kSecond);
    cpu.realtime_used = Nanoseconds::zero();
  }
}

// ---- What happens to threads ----

// In Linux: update_dl_entity, and dl_check_constrained_dl.
void CpuModel::begin_budget(Thread& thread, TimePoint now) {
  auto& [runtime, deadline, period] = thread.reservation;
  if (deadline == Nanoseconds::zero()) deadline = period;
  const Nanoseconds left = between(now, thread.due_);
  const auto product = [](Nanoseconds a, Nanoseconds b) {
    return static_cast<Wide>(a.count()) * b.count();
  };
  const bool is_over = left <= Nanoseconds::zero(), is_short = deadline != period;
  const bool is_too_much = product(thread.budget_, deadline) > product(left, runtime);
  if (is_over && is_short && now < end_of_period(thread.due_, thread)) {
    thread.is_throttled_ = true;
  } else if (is_over || (is_too_much && !is_short)) {
    thread.budget_ = runtime;
    thread.due_ = later(now, deadline);
  } else if (is_too_much) {
    thread.budget_ =
        Nanoseconds(static_cast<std::int64_t>(product(left, runtime) / deadline.count()));
  }
  if (thread.budget_ <= Nanoseconds::zero()) thread.is_throttled_ = true;
}

void CpuModel::wake(Thread& thread, TimePoint now) {
  thread.is_awake_ = true;
  thread.is_preempted_ = false;
  thread.work_ = 0;
  thread.place_ = ++places_;
  if (thread.slice_ <= Nanoseconds::zero()) thread.slice_ = slice_of(thread);
  if (thread.policy == Policy::deadline) begin_budget(thread, now);
  awake_.push_back(&thread);
  share(now);
}

void CpuModel::work(Thread& thread, Nanoseconds amount, TimePoint now) {
  thread.since_ = now;
  thread.keeps_time_ = false;
  thread.work_ += std::min(amount.count(), kMostWork) * kParts;
}

void CpuModel::occupy(Thread& thread, Nanoseconds time, TimePoint now) {
  thread.work_ = std::max<std::int64_t>(0, thread.work_);
  work(thread, time, now);
  thread.keeps_time_ = true;
}

void CpuModel::end_work(Thread& thread, TimePoint now) {
  account(now);
  thread.work_ = std::min<std::int64_t>(0, thread.work_);
}

void CpuModel::sleep(Thread& thread, TimePoint now) {
  account(now);
  thread.is_awake_ = thread.is_throttled_ = false;
  std::erase(awake_, &thread);
  share(now);
}

std::int64_t CpuModel::speed_of(const Thread& thread) const {
  return thread.keeps_time_ ? kParts : states_[thread.cpu_].speed;
}

TimePoint CpuModel::end_of_work(const Thread& thread) const {
  const std::int64_t speed = speed_of(thread);
  return later(thread.since_, Nanoseconds((thread.work_ + speed - 1) / speed));
}

TimePoint CpuModel::next_event(const Thread& thread) const {
  if (thread.is_throttled_) return end_of_period(thread.due_, thread);
  if (thread.cpu_ == kNone) return kNever;
  TimePoint next = end_of_work(thread);
  if (thread.policy == Policy::deadline)
    next = std::min(next, later(thread.since_, thread.budget_));
  if (takes_turns(thread)) next = std::min(next, later(thread.since_, thread.slice_));
  return next;
}

bool CpuModel::happen(Thread& thread, TimePoint now) {
  if (thread.is_throttled_) {
    thread.is_throttled_ = false;
    thread.budget_ = thread.reservation.runtime;
    thread.due_ = later(thread.due_, thread.reservation.period);
    share(now);
    return false;
  }
  account(now);
  if (thread.work_ <= 0) return true;
  if (thread.policy == Policy::deadline) {
    thread.is_throttled_ = true;
  } else {
    thread.slice_ = slice_of(thread);
    thread.place_ = ++places_;
  }
  share(now);
  return false;
}

// ---- What happens to CPUs ----

TimePoint CpuModel::next_event() const {
  TimePoint next = kNever;
  if (!options_.realtime) return next;
  for (const State& cpu : states_) {
    if (cpu.is_throttled) {
      next = std::min(next, cpu.second);
    } else if (cpu.running != nullptr && is_of_realtime(*cpu.running)) {
      next = std::min(
          {next, cpu.second, later(cpu.running->since_, *options_.realtime - cpu.realtime_used)});
    }
  }
  return next;
}

void CpuModel::happen(TimePoint now) {
  account(now);
  for (State& cpu : states_) {
    if (cpu.is_throttled) {
      cpu.is_throttled = now < cpu.second;
    } else {
      cpu.is_throttled = cpu.running != nullptr && is_of_realtime(*cpu.running) &&
                         cpu.realtime_used >= *options_.realtime;
    }
  }
  share(now);
}

}  // namespace takt
