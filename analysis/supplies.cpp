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
    result =
        plus(result, reservation ? most_of(*reservation, window)
                                 : std::min(window, demand_of({part}, plus(window, part->busy))));
  }
  return result / static_cast<Time>(cpus);
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
  if (part.above.empty()) return;
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

// The more urgent first: what these leave is known then.
void find_busy(std::vector<Part>& parts) {
  std::vector<Part*> order;
  for (Part& part : parts) {
    if (part.executor.share) order.push_back(&part);
  }
  std::stable_sort(order.begin(), order.end(), [](const Part* a, const Part* b) {
    return a->executor.share->priority > b->executor.share->priority;
  });
  for (Part* part : order) {
    part->busy = least_fixed_point(
        [&](Time window) { return part->supply.time_for(demand_of({part}, window), part->limit); },
        part->limit);
  }
}

}  // namespace takt::analysis
