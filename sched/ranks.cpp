// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/ranks.hpp"

#include <algorithm>
#include <numeric>

namespace takt {
namespace {

ReadyCallback released(const CallbackInfo& info, std::uint64_t sequence) {
  const bool has_deadline = info.deadline != Nanoseconds::zero();
  return {.info = &info,
          .deadline = has_deadline ? TimePoint(info.deadline) : kNever,
          .sequence = sequence};
}

}  // namespace

std::vector<std::size_t> ranks_of(std::span<const CallbackInfo> infos, const std::string& scheduler,
                                  const OwnValues& own) {
  const auto asked = schedulers().make(scheduler, own);
  asked->configure(infos);
  const auto is_first = [&](std::size_t a, std::size_t b) {
    ReadyCallback first = released(infos[a], 1), second = released(infos[b], 2);
    asked->push(first);
    asked->push(second);
    const bool result = asked->pop() == &first;
    asked->pop();
    return result;
  };
  // Whichever has arrived first.
  const auto is_before = [&](std::size_t a, std::size_t b) {
    return is_first(a, b) && !is_first(b, a);
  };
  std::vector<std::size_t> order(infos.size()), ranks(infos.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), is_before);
  for (std::size_t i = 1; i < order.size(); ++i) {
    ranks[order[i]] = ranks[order[i - 1]] + (is_before(order[i - 1], order[i]) ? 1 : 0);
  }
  return ranks;
}

}  // namespace takt
