// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/sent_messages.hpp"

#include <algorithm>
#include <map>

#include "takt/entities/subscription.hpp"

namespace takt {

SentMessages::SentMessages(const SystemModel& model, const ModelledProcess& process) {
  const auto& all = model.system.callbacks;
  for (std::size_t to = 0; to < process.callbacks.size(); ++to) {
    const auto end =
        std::dynamic_pointer_cast<const SubscriptionBase>(process.callbacks[to].entity);
    if (end == nullptr || end->kind() == EntityKind::client) continue;
    Receiver receiver{.place = to, .end = end, .senders = {}, .others = all[to].arrivals};
    for (std::size_t from = 0; from < process.callbacks.size(); ++from) {
      const analysis::Executor& executor = model.system.executors[all[from].executor];
      for (const analysis::Output& output : all[from].outputs) {
        if (output.to != to) continue;
        const ModelledProcess::Callback& callback = process.callbacks[from];
        receiver.senders.push_back(
            {.name = callback.node->fully_qualified_name() + "/" + callback.entity->name(),
             // Of the inputs of a join, each may be the last one.
             .messages = static_cast<std::uint64_t>(std::max<analysis::Count>(1, output.messages)),
             .at_a_time = std::max(executor.threads, executor.levels)});
      }
    }
    if (!receiver.senders.empty()) receivers_.push_back(std::move(receiver));
  }
}

void SentMessages::begin() {
  count();
  for (Receiver& receiver : receivers_) receiver.before = receiver.now;
  begun_ = Clock::steady().now();
}

void SentMessages::count() {
  for (Receiver& receiver : receivers_) {
    if (const auto end = receiver.end.lock()) receiver.now = end->expected();
  }
}

std::vector<SentMessages::Found> SentMessages::look(
    const std::vector<CallbackStatistics>& callbacks) const {
  std::map<std::string, std::uint64_t> executions;  // of each callback, by all its executors
  for (const CallbackStatistics& each : callbacks)
    executions[each.node + "/" + each.callback] += each.received;
  std::vector<Found> found;
  for (const Receiver& receiver : receivers_) {
    const auto end = receiver.end.lock();
    if (end == nullptr) continue;
    std::uint64_t most = end->counts().from_outside;
    for (const Sender& sender : receiver.senders)
      most += sender.messages * (executions[sender.name] + sender.at_a_time);
    if (receiver.others) {
      const Nanoseconds since = Clock::steady().now() - begun_;
      most += static_cast<std::uint64_t>(receiver.others->most(since.count()));
    }
    if (receiver.now - receiver.before <= most) continue;
    found.push_back({.to = receiver.place, .sent = receiver.now - receiver.before, .most = most});
  }
  return found;
}

}  // namespace takt
