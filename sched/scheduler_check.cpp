// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler_check.hpp"

#include <algorithm>
#include <exception>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/base/returns_in_time.hpp"

namespace takt {
namespace {

using Random = std::minstd_rand;

/// A scheduler under trial, with its callbacks; knows which ones the scheduler must hold.
class Trial {
 public:
  Trial(std::string_view name, Scheduler& scheduler, std::vector<CallbackInfo> infos)
      : name_(name),
        scheduler_(scheduler),
        infos_(std::move(infos)),
        records_(infos_.size()),
        is_waiting_(infos_.size(), false) {
    for (std::size_t i = 0; i < infos_.size(); ++i) records_[i].info = &infos_[i];
    executing_.reserve(kWorkers);
  }

  void run() {
    try {
      scheduler_.configure(infos_);
    } catch (const std::exception& error) {
      fail(fmt::format("throws in configure: {}", error.what()), "take what it is given");
    } catch (...) {
      fail("throws an object in configure that is not a std::exception", "take what it is given");
    }
    const RealtimeScope scope;
    pop();
    for (std::size_t i = 0; i < records_.size(); ++i) push(i);
    pop_all();
    for (std::size_t step = 0; step < 200 * records_.size(); ++step) {
      const std::size_t i = random_() % records_.size();
      if (is_waiting_[i]) {
        pop();
      } else {
        push(i);
      }
    }
    pop_all();
    if (const std::uint64_t allocations = scope.so_far().allocations; allocations != 0) {
      fail(fmt::format("allocates memory after configure, {} times here", allocations),
           "make all the room that it needs in configure");
    }
  }

 private:
  static constexpr std::size_t kWorkers = 4;

  void push(std::size_t i) {
    ReadyCallback& record = records_[i];
    if (record.sequence == 0 || random_() % 4 != 0) {  // else it was parked, with old values
      record.sequence = ++sequence_;
      record.window = sequence_ / 10;
      record.ready_time = TimePoint(Nanoseconds(sequence_));
      record.deadline =
          random_() % 4 == 0 ? kNever : TimePoint(Nanoseconds(sequence_ + random_() % 100));
    }
    is_waiting_[i] = true;
    ++waiting_;
    scheduler_.push(record);
  }

  void pop() {
    const ReadyCallback* popped = scheduler_.pop();
    if (popped == nullptr) {
      if (waiting_ == 0) return;
      fail(fmt::format("pops nothing, and {} of {} callbacks wait", waiting_, records_.size()),
           "return every callback once for each push");
    }
    const auto record = std::find_if(records_.begin(), records_.end(),
                                     [&](const auto& known) { return &known == popped; });
    if (record == records_.end()) {
      fail("pops a callback that it was never given", "return the one that was pushed, no copy");
    }
    const auto i = static_cast<std::size_t>(record - records_.begin());
    if (!is_waiting_[i]) {
      fail(waiting_ == 0 ? "pops a callback when none waits" : "pops a callback twice",
           "return every callback once for each push");
    }
    is_waiting_[i] = false;
    --waiting_;
    if (random_() % 4 != 0) execute(*record);  // else it is parked, or removed
  }

  void pop_all() {
    while (waiting_ != 0) pop();
    pop();
  }

  // Executions end in any order, and a callback may be pushed again before its execution ends.
  void execute(const ReadyCallback& as_picked) {
    executing_.push_back(as_picked);
    if (executing_.size() < kWorkers) return;
    std::swap(executing_[random_() % kWorkers], executing_.back());
    scheduler_.done(executing_.back(), Nanoseconds(random_() % 1000));
    executing_.pop_back();
  }

  [[noreturn]] void fail(const std::string& what, const std::string& what_to_do) const {
    throw Error(fmt::format("scheduler '{}' {}", name_, what), what_to_do);
  }

  const std::string_view name_;
  Scheduler& scheduler_;
  const std::vector<CallbackInfo> infos_;
  std::vector<ReadyCallback> records_;  // record i has info i
  std::vector<bool> is_waiting_;
  std::size_t waiting_ = 0;
  std::vector<ReadyCallback> executing_;
  std::uint64_t sequence_ = 0;
  Random random_{17};
};

/// Callbacks of an executor; with one group, those that the parking place of the group holds.
std::vector<CallbackInfo> callbacks(std::size_t count, CallbackId id_step, GroupId groups) {
  Random random{17};
  std::vector<CallbackInfo> infos(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto chain = static_cast<ChainId>(random() % 3);
    const auto id = static_cast<CallbackId>(i * id_step);
    infos[i] = {.id = id,
                .kind = static_cast<EntityKind>(random() % 5),
                .registration = id,
                .group = groups == 1 ? 5 : static_cast<GroupId>(random() % groups),
                .node = static_cast<NodeId>(random() % 4),
                .priority = static_cast<int>(random() % 3),
                .period = Nanoseconds(random() % 1000),
                .deadline = Nanoseconds(random() % 1000),
                .budget = Nanoseconds(random() % 1000),
                .criticality = static_cast<int>(chain),
                .chain = chain,
                .chain_position = id};
  }
  return infos;
}

void try_scheduler(const std::string& name,
                   const std::function<std::unique_ptr<Scheduler>()>& make) {
  for (const auto& infos :
       {callbacks(0, 1, 1), callbacks(1, 1, 1), callbacks(10, 3, 1), callbacks(50, 1, 8)}) {
    std::unique_ptr<Scheduler> scheduler;
    try {
      scheduler = make();
    } catch (const Error&) {  // a value of one of its keys is invalid
      throw;
    } catch (const std::exception& error) {
      throw Error(fmt::format("scheduler '{}' throws in its constructor: {}", name, error.what()),
                  "let it be made whenever an executor needs one");
    } catch (...) {
      throw Error(
          fmt::format(
              "scheduler '{}' throws an object in its constructor that is not a std::exception",
              name),
          "let it be made whenever an executor needs one");
    }
    Trial(name, *scheduler, infos).run();
  }
}

}  // namespace

void check_scheduler(std::string_view name, const std::function<std::unique_ptr<Scheduler>()>& make,
                     Nanoseconds limit) {
  const auto trial = [name = std::string(name), make] { try_scheduler(name, make); };
  if (returns_in_time(trial, limit)) return;
  throw Error(fmt::format("scheduler '{}' has not returned for {}", name, to_string(limit)),
              "let each of its functions return, also without a callback that waits");
}

}  // namespace takt
