// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/supplies.hpp"

#include <algorithm>

namespace takt::analysis {
namespace {

// With what it costs to come and go between others, once for each execution.
Time demand_of(const std::vector<const Part*>& parts, Time window) {
  Time result = 0;
  for (const Part* part : parts) {
    const Time switches = times(2, part->system.overheads.context_switch);
    result = plus(result, part->demand_with_spinning(window, switches));
  }
  return result;
}

// What these executions cost a thread that goes on elsewhere. A reservation's may be interrupted at
// the end of each of its budgets.
Time moves_by(const std::vector<const Part*>& parts, Time window) {
  Time result = 0;
  for (const Part* part : parts) {
    const Time each = times(2, part->system.overheads.context_switch);
    if (each == 0) continue;
    const Time before = plus(window, part->busy);
    const Time with_moves = part->demand_with_spinning(before, each);
    if (with_moves >= kUnbounded) return kUnbounded;
    result = plus(result, with_moves - part->demand_with_spinning(before, 0));
    const auto& reservation = part->executor.reservation;
    if (reservation) result = plus(result, times(each, window / reservation->period + 2));
  }
  return result;
}

// In any window: what is left of a budget, its share, and a whole budget at the end. A thread that
// wakes early, and gets a new budget for that, has used no more than its share of the time before.
Time most_of(const Reservation& reservation, Time window) {
  const Time share = times(reservation.budget, window) / reservation.period;
  return std::min(window, plus(share, times(2, reservation.budget)));
}

// While it waits, each of its CPUs runs one of them. What is left of their work when a window
// begins has come since they had nothing to do. Source: Bertogna, Cirinei, Lipari, TPDS 2009, for
// jobs of tasks.
Time taken_by(const std::vector<const Part*>& above, std::size_t cpus, Time window) {
  Time result = 0;
  for (const Part* part : above) {
    const auto& reservation = part->executor.reservation;
    result = plus(result, reservation ? most_of(*reservation, window)
                                      : std::min(window, part->demand_with_spinning(
                                                             plus(window, part->busy), 0)));
  }
  return plus(result / static_cast<Time>(cpus), moves_by(above, window));
}

void find_above(Part& part, const std::vector<Part>& parts) {
  bool has_equals = false, are_bound = true;
  for (const std::size_t other :
       rivals(part.system, static_cast<std::size_t>(&part - parts.data()))) {
    const auto& theirs = parts[other].executor.share;
    has_equals = has_equals || (theirs && theirs->priority == part.executor.share->priority);
    are_bound = are_bound && theirs && theirs->cpus.size() == 1;
    part.above.push_back(&parts[other]);
  }
  if (part.above.empty()) {
    for (const std::size_t other : part.executor.movers) part.movers.push_back(&parts[other]);
    if (!part.movers.empty() && part.system.overheads.context_switch != 0)
      part.supply = Supply([&part](Time window) { return moves_by(part.movers, window); }, false);
    return;
  }
  const std::size_t cpus = part.executor.share->cpus.size();
  if (cpus == 1 && are_bound) {
    part.supply =
        Supply([&part](Time window) { return demand_of(part.above, window); }, has_equals);
  } else if (has_equals) {  // each would wait for what the other has left over
    part.supply = Supply([](Time) { return kUnbounded; }, has_equals);
  } else {
    part.supply = Supply([&part, cpus](Time window) { return taken_by(part.above, cpus, window); },
                         has_equals);
  }
}

// Those of a CPU share what Linux grants. Which CPUs those without a share use is not known: they
// may be on each.
void limit(Part& part, const std::vector<Part>& parts) {
  if (!part.system.for_realtime || !part.executor.is_realtime) return;
  part.supply.limit(*part.system.for_realtime, part.system.may_come_twice, part.is_throttled);
  for (const Part& other : parts) {
    const auto& mine = part.executor.share;
    const auto& theirs = other.executor.share;
    const bool is_together = !mine || !theirs || mine->meets(*theirs);
    if (other.executor.is_realtime && is_together) part.realtime.push_back(&other);
  }
}

}  // namespace

void make_supplies(std::vector<Part>& parts) {
  for (Part& part : parts) {
    if (part.executor.reservation) part.supply = Supply(*part.executor.reservation);
    find_above(part, parts);
    limit(part, parts);
  }
}

// What runs in a period has arrived in it, or since the CPU was idle the last time.
void find_throttled(std::vector<Part>& parts) {
  for (Part& part : parts) {
    if (part.realtime.empty()) continue;
    const auto [budget, period] = *part.system.for_realtime;
    const auto wanted = [&part](Time window) { return demand_of(part.realtime, window); };
    const Time busy = least_fixed_point(wanted, part.limit);
    part.is_throttled = wanted(plus(busy, period)) > budget;
  }
}

// What one has depends on the more urgent ones. A pool has threads of several priorities, so two
// may depend on each other: what grows on then has no end.
void find_busy(std::vector<Part>& parts) {
  for (Part& part : parts) part.busy = 0;
  bool grows = true;
  for (std::size_t round = 0; grows && round <= parts.size(); ++round) {
    grows = false;
    for (Part& part : parts) {
      const Time busy = least_fixed_point(
          [&](Time window) { return part.supply.time_for(demand_of({&part}, window), part.limit); },
          part.limit);
      if (busy == part.busy) continue;
      grows = true;
      part.busy = round < parts.size() ? busy : kUnbounded;
    }
  }
}

}  // namespace takt::analysis
