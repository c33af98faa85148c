// The internal state of a node.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_NODE_STATE_HPP_
#define TAKT_NODES_NODE_STATE_HPP_

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/entities/callback_list.hpp"
#include "takt/nodes/node.hpp"
#include "takt/nodes/parameter_store.hpp"

namespace takt {

/// Thread safety and real-time: as Node, whose methods take the mutex.
struct Node::State {
  State(std::string node, const NodeOptions& options)
      : parameters(std::move(node), options.parameters,
                   {options.allow_undeclared_parameters, options.exact_parameter_types}) {}

  /// Calls each listener, without the mutex; one that is removed meanwhile is left out.
  template <class Call>
  void notify(Call&& call) {
    listener_calls.each(ListenerCalls::Order::first_added, [&](const auto& listener) {
      call(listener());
      return true;
    });
  }

  ParameterStore parameters;
  using ListenerCalls = detail::CallbackList<NodeListener&()>;
  ListenerCalls listener_calls;

  RankedMutex<LockRank::node> mutex;  // guards all below
  std::vector<std::weak_ptr<Entity>> entities;
  std::vector<std::weak_ptr<CallbackGroup>> groups;
  std::vector<std::pair<NodeListener*, ListenerCalls::Entry>> listeners;
  std::set<std::string, std::less<>> used_remaps, topics, timers_of_one_name;
  std::map<std::string, std::weak_ptr<Timer>, std::less<>> timers;  // that the user holds
  int wall_timers = 0;
  std::map<std::string, PublishingCallbacks, std::less<>> outputs;  // by topic
};

}  // namespace takt

#endif  // TAKT_NODES_NODE_STATE_HPP_
