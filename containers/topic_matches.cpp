// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/topic_matches.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"

namespace takt {

std::string TopicMatches::hint() {
  std::vector<OneSidedTopic> topics;
  try {
    topics = one_sided_topics(setting_.participant.get());
  } catch (const Error&) {  // DDS Security may forbid reading the graph
    if (setting_.description.must_match.empty()) return "";
    throw;
  }
  if (!std::exchange(has_checked_, true)) require(topics);
  std::erase_if(topics, [this](const OneSidedTopic& topic) {
    return setting_.description.must_match.contains(topic.name);  // already reported as an error
  });
  return hint_at(topics);
}

void TopicMatches::require(const std::vector<OneSidedTopic>& topics) {
  for (const auto& [name, where] : setting_.description.must_match) {
    const auto one_sided =
        std::find_if(topics.begin(), topics.end(),
                     [&required = name](const auto& topic) { return topic.name == required; });
    std::string reason;
    if (one_sided != topics.end()) {
      reason = one_sided->reason();
    } else if (!is_known_topic(name, setting_.participant.get())) {
      reason = "it has no publisher and no subscription; check its name";
    } else {
      continue;
    }
    std::string error =
        Error(fmt::format("topic '{}' must match: {}", name, reason), "", where).what();
    log(LogLevel::error, "{}", error);
    setting_.fail(std::move(error));
  }
}

}  // namespace takt
