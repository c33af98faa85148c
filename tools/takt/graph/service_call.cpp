// SPDX-License-Identifier: Apache-2.0
#include "graph/service_call.hpp"

#include <set>

namespace takt::tools {

std::vector<std::string> Caller::find(const std::string& ending) const {
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  std::set<std::string> names;
  for (const GraphEndpoint& service : participant_->graph().services) {
    if (!service.name.ends_with(ending)) continue;
    names.insert(service.name.substr(1, service.name.size() - 1 - ending.size()));
  }
  return {names.begin(), names.end()};
}

void Caller::nobody(const std::string& whose) const {
  throw Error(fmt::format("{} was not found within 3 s", whose),
              "check that it runs on the same DDS domain (--domain, ROS_DOMAIN_ID)");
}

}  // namespace takt::tools
