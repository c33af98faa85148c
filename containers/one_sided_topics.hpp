// Finds topics that have publishers but no subscription, or the reverse: often a misspelt name.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_ONE_SIDED_TOPICS_HPP_
#define TAKT_CONTAINERS_ONE_SIDED_TOPICS_HPP_

#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/transport/dds/participant.hpp"

namespace TAKT_PUBLIC takt {

/// A topic that this process publishes without any subscription, or subscribes to without any
/// publisher.
struct OneSidedTopic {
  std::string name;
  bool is_published = false;       // by this process; else it subscribes
  std::vector<std::string> nodes;  // of this process, sorted

  /// "nobody publishes it for /map, /planner"
  std::string reason() const;
};

/// Returns them sorted by name, from the endpoints of this process and those that `participant` has
/// discovered so far (nullptr: no DDS). Thread safety: from any thread. Real-time: no.
std::vector<OneSidedTopic> one_sided_topics(Participant* participant);

/// Whether the topic has a publisher or a subscription, in this process or discovered by
/// `participant`. Thread safety: from any thread. Real-time: no.
bool is_known_topic(const std::string& name, Participant* participant);

/// Whether every node has this topic, or it is one of ROS 2's hidden ones.
bool is_everywhere(const std::string& topic);

/// Returns one line about the topics that may be mistakes; empty if there are none. It leaves out
/// the topics that every node has, and ROS 2's hidden topics.
std::string hint_at(const std::vector<OneSidedTopic>& topics);

}  // namespace takt

#endif  // TAKT_CONTAINERS_ONE_SIDED_TOPICS_HPP_
