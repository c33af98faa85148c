// The internal state of a node.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_NODE_STATE_HPP_
#define TAKT_NODES_NODE_STATE_HPP_

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
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
    std::unique_lock lock(mutex);
    const std::vector<NodeListener*> at_first = listeners;
    for (NodeListener* listener : at_first) {
      if (std::find(listeners.begin(), listeners.end(), listener) == listeners.end()) continue;
      const std::pair running(listener, std::this_thread::get_id());
      listener_calls.push_back(running);
      lock.unlock();
      std::exception_ptr exception;
      try {
        call(*listener);
      } catch (...) {
        exception = std::current_exception();
      }
      lock.lock();
      listener_calls.erase(std::find(listener_calls.begin(), listener_calls.end(), running));
      listener_called.notify_all();
      if (exception != nullptr) std::rethrow_exception(exception);
    }
  }

  ParameterStore parameters;

  PiMutex mutex;  // guards all below
  std::vector<std::weak_ptr<Entity>> entities;
  std::vector<std::weak_ptr<CallbackGroup>> groups;
  std::vector<NodeListener*> listeners;
  std::vector<std::pair<NodeListener*, std::thread::id>> listener_calls;  // that run now
  std::condition_variable_any listener_called;
  std::set<std::string, std::less<>> used_remaps, topics, timers_of_one_name;
  std::map<std::string, std::weak_ptr<Timer>, std::less<>> timers;  // that the user holds
  int wall_timers = 0;
  std::map<std::string, PublishingCallbacks, std::less<>> outputs;  // by topic
};

}  // namespace takt

#endif  // TAKT_NODES_NODE_STATE_HPP_
