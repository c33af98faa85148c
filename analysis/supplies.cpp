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

void find_above(Part& part, const std::vector<Part>& parts) {
  const auto& mine = part.executor.share;
  if (!mine) return;
  bool has_equals = false;
  for (const Part& other : parts) {
    const auto& share = other.executor.share;
    if (&other == &part || !share || share->cpu != mine->cpu || share->priority < mine->priority) {
      continue;
    }
    part.above.push_back(&other);
    has_equals = has_equals || share->priority == mine->priority;
  }
  if (part.above.empty()) return;
  part.supply = Supply([&part](Time window) { return demand_of(part.above, window); }, has_equals);
}

// Those of a CPU share what Linux grants. Which CPUs the others use is not known, so all of these
// count as one.
void limit(Part& part, const std::vector<Part>& parts) {
  if (!part.system.for_realtime || !part.executor.is_realtime) return;
  part.supply.limit(*part.system.for_realtime, part.is_throttled);
  for (const Part& other : parts) {
    const auto& mine = part.executor.share;
    const auto& theirs = other.executor.share;
    const bool is_together = mine && theirs ? mine->cpu == theirs->cpu : !mine && !theirs;
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

}  // namespace takt::analysis
