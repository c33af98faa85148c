// Which topics of a container lack publishers or subscriptions, and which must have both. Private
// to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_TOPIC_MATCHES_HPP_
#define TAKT_CONTAINERS_TOPIC_MATCHES_HPP_

#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/container_setting.hpp"
#include "takt/containers/one_sided_topics.hpp"

namespace TAKT_INTERNAL takt {

/// Thread safety: one control thread. Real-time: no.
class TopicMatches {
 public:
  explicit TopicMatches(ContainerSetting& setting) : setting_(setting) {}
  /// See hint_at(). The first call checks `must_match`: a topic there without a match is an error,
  /// and a failure of the run.
  std::string hint();

 private:
  void require(const std::vector<OneSidedTopic>& topics);

  ContainerSetting& setting_;
  bool has_checked_ = false;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_TOPIC_MATCHES_HPP_
