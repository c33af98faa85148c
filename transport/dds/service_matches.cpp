// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/service_matches.hpp"

#include <algorithm>
#include <mutex>

namespace takt {

void ServiceMatches::add(Topic topic, dds_instance_handle_t end, const std::string& id) {
  const std::lock_guard lock(mutex_);
  ids_[topic][end] = id;
}

void ServiceMatches::remove(Topic topic, dds_instance_handle_t end) {
  const std::lock_guard lock(mutex_);
  ids_[topic].erase(end);
  if (topic == requests) {
    std::erase_if(callers_, [end](const auto& caller) { return caller.second == end; });
  }
}

bool ServiceMatches::knows(Topic topic, dds_instance_handle_t end) const {
  const std::lock_guard lock(mutex_);
  return ids_[topic].contains(end);
}

bool ServiceMatches::has(Topic topic, const std::string& id) const {
  return std::any_of(ids_[topic].begin(), ids_[topic].end(),
                     [&](const auto& end) { return end.second == id; });
}

std::size_t ServiceMatches::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(ids_[requests].begin(), ids_[requests].end(),
                    [this](const auto& end) { return has(responses, end.second); }));
}

void ServiceMatches::called(std::uint64_t client, dds_instance_handle_t writer) {
  const std::lock_guard lock(mutex_);
  if (ids_[requests].contains(writer)) callers_[client] = writer;
}

bool ServiceMatches::can_hear(std::uint64_t client) const {
  const std::lock_guard lock(mutex_);
  const auto caller = callers_.find(client);
  if (caller == callers_.end()) return true;
  const std::string& id = ids_[requests].at(caller->second);
  return id.empty() || has(responses, id);
}

}  // namespace takt
