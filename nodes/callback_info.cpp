// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/callback_info.hpp"

#include <algorithm>

#include "takt/nodes/chain.hpp"

namespace takt {

CallbackInfo callback_info(const Node& node, const Entity& entity, const CallbackInfo& ids) {
  const CallbackParameters parameters = node.callback_parameters(entity);
  CallbackInfo info = ids;
  info.kind = entity.kind();
  info.chain = kNoChain;
  info.chain_position = 0;
  info.chain_deadline = Nanoseconds::zero();
  info.chain_concurrency = 0;
  info.criticality = 0;
  info.priority = parameters.priority.value_or(0);
  info.deadline = parameters.deadline.value_or(Nanoseconds::zero());
  info.budget = parameters.budget.value_or(Nanoseconds::zero());
  info.period = entity.period();
  if (info.period == Nanoseconds::zero()) {
    info.period = parameters.period.value_or(Nanoseconds::zero());
  }
  const auto& steps = entity.chain_steps();
  const auto step = std::max_element(steps.begin(), steps.end(), [](const auto& a, const auto& b) {
    return a.chain->options().priority < b.chain->options().priority;
  });
  if (step != steps.end()) {
    info.chain = step->chain->id();
    info.chain_position = step->position;
    info.chain_deadline = step->chain->options().deadline;
    info.chain_concurrency = step->chain->options().concurrency;
    info.criticality = step->chain->options().priority;
  }
  info.criticality = parameters.criticality.value_or(info.criticality);
  return info;
}

}  // namespace takt
