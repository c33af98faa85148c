// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/supplies.hpp"

#include <algorithm>

namespace takt::analysis {
namespace {

// What it costs a thread of SCHED_RR that runs for so long to go behind its equals and come back.
// Its first slice may be nearly over.
Time turns_of(const Part& part, Time time) {
  const Time slice = part.executor.share ? part.executor.share->slice : 0;
  if (slice == 0 || !part.supply.has_equals()) return 0;
  return times(times(2, part.system.overheads.context_switch), time / slice + 1);
}

// With what it costs to come and go between others, once for each execution.
Time demand_of(const std::vector<const Part*>& parts, Time window) {
  Time result = 0;
  for (const Part* part : parts) {
    const Time switches = times(2, part->system.overheads.context_switch);
    const Time demand = part->demand_with_spinning(window, switches);
    result = plus(result, plus(demand, turns_of(*part, demand)));
  }
  return result;
}

// What one execution of an executor costs a thread whose CPU it takes. A reservation goes back to
// the CPU that it had: so others may have to go when one comes, and when one goes.
Time switches_of(const Part& part) {
  return times(part.executor.reservation ? 4 : 2, part.system.overheads.context_switch);
}

// The same of all in a window. A reservation's may be interrupted at the end of each of its
// budgets.
Time moves_by(const Part& part, Time window) {
  const Time each = switches_of(part);
  if (each == 0) return 0;
  const Time with_moves = part.demand_with_spinning(window, each);
  if (with_moves >= kUnbounded) return kUnbounded;
  const auto& reservation = part.executor.reservation;
  return plus(with_moves - part.demand_with_spinning(window, 0),
              reservation ? times(each, window / reservation->period + 2) : 0);
}

// What these executions, and those before, cost a thread that goes on elsewhere.
Time moves_by(const std::vector<const Part*>& parts, Time window) {
  Time result = 0;
  for (const Part* part : parts) result = plus(result, moves_by(*part, plus(window, part->busy)));
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
Time taken_by(const Part& part, Time window) {
  Time result = 0;
  for (const Part* other : part.above) {
    const auto& reservation = other->executor.reservation;
    result = plus(result, reservation ? most_of(*reservation, window)
                                      : std::min(window, other->demand_with_spinning(
                                                             plus(window, other->busy), 0)));
  }
  return plus(result / static_cast<Time>(part.executor.share->cpus.size()),
              plus(moves_by(part.above, window), moves_by(part.movers, window)));
}

// All others with a reservation may preempt it, wherever they run, when they come and when their
// budgets do: what they have not done when a window begins does not come in it.
void reserve(Part& part, const std::vector<Part>& parts) {
  const auto switches = [&part, &parts](Time window) {
    Time result = 0;
    for (const Part& other : parts) {
      if (&other != &part && other.executor.reservation)
        result = plus(result, moves_by(other, window));
    }
    return result;
  };
  const bool is_free = part.system.overheads.context_switch == 0;
  part.supply = Supply(*part.executor.reservation, is_free ? Supply::Demand() : switches);
}

void find_above(Part& part, const std::vector<Part>& parts) {
  bool has_equals = false, are_bound = true;
  const auto index = static_cast<std::size_t>(&part - parts.data());
  for (const std::size_t other : pushers(part.system, index)) part.movers.push_back(&parts[other]);
  for (const std::size_t other : rivals(part.system, index)) {
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
  if (part.executor.share->cpus.size() == 1 && are_bound) {
    part.supply = Supply(
        [&part](Time window) {
          return plus(demand_of(part.above, window), turns_of(part, window));
        },
        has_equals);
  } else if (has_equals) {  // each would wait for what the other has left over
    part.supply = Supply([](Time) { return kUnbounded; }, has_equals);
  } else {
    part.supply = Supply([&part](Time window) { return taken_by(part, window); }, has_equals);
  }
}

// Those of a CPU share what Linux grants. Which CPUs those without a share use is not known: they
// may be on each.
void limit(Part& part, const std::vector<Part>& parts) {
  if (!part.system.for_realtime || !part.executor.is_realtime) return;
  // One that Linux makes wait has been preempted.
  const auto& [budget, period] = *part.system.for_realtime;
  const Time switches = times(2, part.system.overheads.context_switch);
  part.supply.limit({std::max(Time{0}, budget - switches), period}, part.system.may_come_twice,
                    part.is_throttled);
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
    if (part.executor.reservation) {
      reserve(part, parts);
    } else {
      find_above(part, parts);
    }
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
      Time supplied = 0;  // in a longer window no less
      const Time busy = least_fixed_point(
          [&](Time window) {
            return supplied =
                       part.supply.time_for(demand_of({&part}, window), part.limit, supplied);
          },
          part.limit);
      if (busy == part.busy) continue;
      grows = true;
      part.busy = round < parts.size() ? busy : kUnbounded;
    }
  }
}

}  // namespace takt::analysis
