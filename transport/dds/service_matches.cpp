// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/service_matches.hpp"

#include <algorithm>
#include <mutex>

#include "takt/base/logger.hpp"

namespace takt {

void ServiceMatches::add(Topic topic, dds_instance_handle_t end, const std::string& id) {
  const std::lock_guard lock(mutex_);
  ids_[topic][end] = id;
}

void ServiceMatches::remove(Topic topic, dds_instance_handle_t end) {
  const std::lock_guard lock(mutex_);
  ids_[topic].erase(end);
  if (topic == requests) forget_caller(end);
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
  const auto known = clients_.find(writer);
  if (known != clients_.end() && known->second == client) return;
  if (!ids_[requests].contains(writer)) return;
  if (known != clients_.end()) {
    ++changed_callers_;
    forget_caller(writer);
    if (static constinit LogThrottle throttle; throttle.may_log()) {
      log(LogLevel::warn, "a client of a service ({}) changes its number with its requests",
          ids_[requests].at(writer));
    }
  }
  if (callers_.try_emplace(client, writer).second) clients_[writer] = client;
}

void ServiceMatches::forget_caller(dds_instance_handle_t writer) {
  const auto known = clients_.find(writer);
  if (known == clients_.end()) return;
  callers_.erase(known->second);
  clients_.erase(known);
}

std::size_t ServiceMatches::callers() const {
  const std::lock_guard lock(mutex_);
  return callers_.size();
}

std::uint64_t ServiceMatches::changed_callers() const {
  const std::lock_guard lock(mutex_);
  return changed_callers_;
}

bool ServiceMatches::can_hear(std::uint64_t client) const {
  const std::lock_guard lock(mutex_);
  const auto caller = callers_.find(client);
  if (caller == callers_.end()) return true;
  const std::string& id = ids_[requests].at(caller->second);
  return id.empty() || has(responses, id);
}

}  // namespace takt
