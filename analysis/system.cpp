// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/system.hpp"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt::analysis {
namespace {

void refuse_unless(bool is_right, const std::string& of, const char* what) {
  if (!is_right) throw Error(fmt::format("'{}': {}", of, what));
}

}  // namespace

bool Executor::Share::meets(const Share& other) const {
  return std::find_first_of(cpus.begin(), cpus.end(), other.cpus.begin(), other.cpus.end()) !=
         cpus.end();
}

std::vector<std::size_t> rivals(const System& system, std::size_t executor) {
  const auto& mine = system.executors[executor].share;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; mine && i < system.executors.size(); ++i) {
    const auto& [reservation, theirs] =
        std::tie(system.executors[i].reservation, system.executors[i].share);
    const bool preempts = theirs && mine->yields_to(*theirs);
    if (i != executor && (reservation || preempts)) found.push_back(i);
  }
  if (mine && found.size() < mine->cpus.size()) found.clear();
  return found;
}

std::vector<std::size_t> pushers(const System& system, std::size_t executor) {
  const auto& [mine, movers] =
      std::tie(system.executors[executor].share, system.executors[executor].movers);
  if (system.overheads.context_switch == 0) return {};
  bool may_one_come = false;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < system.executors.size(); ++i) {
    const auto& theirs = system.executors[i].share;
    if (i == executor || !theirs || (mine && theirs->priority < mine->priority)) continue;
    const bool meets =
        mine ? mine->meets(*theirs) : std::find(movers.begin(), movers.end(), i) != movers.end();
    may_one_come |= meets && theirs->cpus.size() > 1;
    if (!meets) found.push_back(i);
  }
  if (!may_one_come) found.clear();
  return found;
}

void check(const System& system) {
  const auto is_time = [](Time time) { return time >= 0 && time <= kUnbounded; };
  for (const Executor& executor : system.executors) {
    refuse_unless(executor.threads > 0, executor.name, "an executor has one thread at least");
    refuse_unless(executor.levels == 0 || (executor.threads == 1 && !executor.is_wait_set),
                  executor.name,
                  "callbacks interrupt each other on one CPU, without polling points");
    refuse_unless(executor.let_period >= 0 && executor.sending >= 0, executor.name,
                  "a period, and what it takes to send at its end, are not negative");
    refuse_unless(executor.early_wake >= 0 && executor.spin >= 0 && executor.more_dispatch >= 0,
                  executor.name, "what it spins, and a dispatch, are not negative");
    refuse_unless(!executor.share || !executor.share->cpus.empty(), executor.name,
                  "a thread has one CPU at least");
    if (!executor.reservation) continue;
    const auto& [budget, period] = *executor.reservation;
    refuse_unless(budget > 0 && budget <= period, executor.name,
                  "a reservation's budget is positive, and at most its period");
  }
  if (system.for_realtime) {
    const auto& [budget, period] = *system.for_realtime;
    refuse_unless(budget > 0 && budget <= period, "for_realtime",
                  "its budget is positive, and at most its period");
  }
  for (const Callback& callback : system.callbacks) {
    refuse_unless(callback.executor < system.executors.size(), callback.name,
                  "its executor is not in the system");
    refuse_unless(is_time(callback.execution), callback.name, "its execution time is too long");
    refuse_unless(callback.least_execution >= 0 && callback.least_execution <= callback.execution,
                  callback.name, "its least execution time is negative, or above the longest");
    for (const Output& output : callback.outputs) {
      refuse_unless(output.to < system.callbacks.size(), callback.name,
                    "it sends to a callback that is not in the system");
      refuse_unless(output.messages > 0 || (output.messages == 0 && output.waits), callback.name,
                    "an output has one message at least");
      refuse_unless(output.least_delay >= 0 && output.least_delay <= output.delay, callback.name,
                    "an output has a delay that is not negative, and not below the least");
      refuse_unless(is_time(output.delay), callback.name, "an output's delay is too long");
    }
  }
  const auto& [dispatch, wake, context_switch] = system.overheads;
  refuse_unless(is_time(dispatch) && is_time(wake) && is_time(context_switch), "overheads",
                "none is negative, or longer than 73 years");
  for (const Chain& chain : system.chains) {
    refuse_unless(!chain.callbacks.empty(), chain.name, "a chain has one callback at least");
    for (const std::size_t callback : chain.callbacks) {
      refuse_unless(callback < system.callbacks.size(), chain.name,
                    "the chain has a callback that is not in the system");
    }
  }
}

}  // namespace takt::analysis
