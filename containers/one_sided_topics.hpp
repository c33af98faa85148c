// Which topics have publishers and no subscription, or the other way round, and what to say of it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_ONE_SIDED_TOPICS_HPP_
#define TAKT_CONTAINERS_ONE_SIDED_TOPICS_HPP_

#include <string>
#include <vector>

#include "takt/transport/dds/participant.hpp"

namespace takt {

/// A topic that this process publishes or subscribes to, and nobody does the other.
struct OneSidedTopic {
  std::string name;
  bool is_published = false;       // else it is subscribed to
  std::vector<std::string> nodes;  // of this process, sorted

  /// "nobody publishes it for /map, /planner"
  std::string reason() const;
};

/// By name: from what is in this process, and what `participant` has discovered by now; nullptr:
/// without DDS. Thread safety: from any thread. Real-time: no.
std::vector<OneSidedTopic> one_sided_topics(Participant* participant);

/// Whether anybody publishes it or subscribes to it, in this process or as far as `participant` has
/// discovered. Thread safety: from any thread. Real-time: no.
bool is_known_topic(const std::string& name, Participant* participant);

/// One line for those of them that a user may have got wrong; empty: there are none. Left out are
/// the topics that every node has, and those that ROS 2 hides.
std::string hint_at(const std::vector<OneSidedTopic>& topics);

}  // namespace takt

#endif  // TAKT_CONTAINERS_ONE_SIDED_TOPICS_HPP_
