// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/ranks.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

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
  // a comes before b in both orders of arrival.
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

bool heeds_demotion(const std::string& scheduler, const OwnValues& own) {
  CallbackInfo urgent{.priority = 1,
                      .period = Nanoseconds(1),
                      .deadline = Nanoseconds(1),
                      .criticality = 1,
                      .chain = 1,
                      .chain_deadline = Nanoseconds(1)};
  CallbackInfo last = demoted(urgent);
  last.id = 1;
  // Tried with both orders of registration: a scheduler by registration would pass one by chance.
  const auto comes_last = [&] {
    const auto ranks = ranks_of(std::array{urgent, last}, scheduler, own);
    return ranks[0] < ranks[1];
  };
  last.registration = last.group = last.node = 1;
  if (!comes_last()) return false;
  std::swap(urgent.registration, last.registration);
  std::swap(urgent.group, last.group);
  std::swap(urgent.node, last.node);
  return comes_last();
}

}  // namespace takt
