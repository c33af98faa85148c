// SPDX-License-Identifier: Apache-2.0
#include "service_call.hpp"

#include <set>

namespace takt::tools {

std::vector<std::string> Caller::find(const std::string& ending) const {
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const std::string last = ending + "Request";
  std::set<std::string> names;
  for (const std::string& topic : participant_->topics_read()) {
    if (!topic.starts_with("rq/") || !topic.ends_with(last)) continue;
    names.insert(topic.substr(3, topic.size() - 3 - last.size()));
  }
  return {names.begin(), names.end()};
}

void Caller::nobody(const std::string& whose) const {
  throw Error(fmt::format("{} has not been found within 3 s", whose),
              "does it run, on the same DDS domain (--domain, ROS_DOMAIN_ID)?");
}

}  // namespace takt::tools
