// What a join holds back until its other inputs have come.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/solver.hpp"

namespace takt::analysis {

// All that it waits for.
template <class Function>
void Solver::for_each_sender(const Output& output, const Function& function) const {
  for (std::size_t sender = 0; sender < system_.callbacks.size(); ++sender) {
    for (const Output& other : system_.callbacks[sender].outputs) {
      if (other.waits && other.to == output.to) function(sender, other);
    }
  }
}

// How long an input of a join waits after it has been served: until the next of this input has
// been, as it is sent by then, or left out for that one; or until all other inputs have come again.
Time Solver::wait_of_join(std::size_t from, Time own_gap, const Output& output) const {
  Time others = 0;
  for_each_sender(output, [&](std::size_t sender, const Output&) {
    if (sender != from) others = std::max(others, next_end(sender));
  });
  return std::min(may_lose_before(from) ? kUnbounded : own_gap, others);
}

// From any instant until the callback has run once more.
Time Solver::next_end(std::size_t callback) const {
  const Part& part = parts_[system_.callbacks[callback].executor];
  Time least = kUnbounded;
  for (std::size_t source = 0; source < part.sources.size(); ++source) {
    if (part.executions(source, callback) == 0) continue;
    least = std::min(
        least, plus(part.sources[source].longest_gap, part.spans[source].at(callback).latest_end));
  }
  return least < kUnbounded && !may_lose_before(callback) ? least : kUnbounded;
}

// Whether a message may be lost on the way to it: then the next one comes later than it is sent.
bool Solver::may_lose_before(std::size_t callback) const {
  std::vector<bool> is_before(system_.callbacks.size());
  is_before[callback] = true;
  for (auto from = ordered_.rbegin(); from != ordered_.rend(); ++from) {
    const Callback& described = system_.callbacks[*from];
    for (const Output& output : described.outputs) {
      if (is_before[output.to]) is_before[*from] = true;
    }
    const bool overflows =
        described.depth && parts_[described.executor].backlog(*from) > *described.depth;
    if (is_before[*from] && (described.may_lose || overflows)) return true;
  }
  return false;
}

// How long after the end of its sender a message is sent: a join's with the last of its inputs.
Time Solver::sent_after(std::size_t from, const Output& output) const {
  Time longest = parts_[system_.callbacks[from].executor].sent_after(from);
  if (!output.waits) return longest;
  for_each_sender(output, [&](std::size_t sender, const Output&) {
    longest = std::max(longest, parts_[system_.callbacks[sender].executor].longest_held());
  });
  return longest;
}

// From one message to the next. A join waits for the slowest of its inputs.
Time Solver::longest_gap(std::size_t from, const Output& output) const {
  const auto of_sender = [&](std::size_t sender, const Output& sent) {
    const Part& part = parts_[system_.callbacks[sender].executor];
    Time least = kUnbounded;
    for (std::size_t source = 0; source < part.sources.size(); ++source) {
      if (part.executions(source, sender) == 0) continue;
      const Span& span = part.spans[source].at(sender);
      const Time earliest = sent.waits ? span.earliest_end : part.earliest_sent(span);
      least = std::min(least, plus(part.sources[source].longest_gap,
                                   plus(between(earliest, span.latest_end),
                                        between(sent.least_delay, sent.delay))));
    }
    return least;
  };
  Time longest = 0;
  if (output.waits) {
    for_each_sender(output, [&](std::size_t sender, const Output& other) {
      longest = std::max(longest, of_sender(sender, other));
    });
  } else {
    longest = of_sender(from, output);
  }
  return plus(longest, sent_after(from, output));
}

}  // namespace takt::analysis
