// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/service_matches.hpp"

#include <algorithm>
#include <mutex>

namespace takt {

void ServiceMatches::add(Topic topic, dds_instance_handle_t end, const std::string& id) {
  const std::lock_guard lock(mutex_);
  ends_[topic].insert_or_assign(end, End{id, ++come_});
}

void ServiceMatches::remove(Topic topic, dds_instance_handle_t end) {
  const std::lock_guard lock(mutex_);
  ends_[topic].erase(end);
  if (topic == requests) forget_caller(end);
}

bool ServiceMatches::knows(Topic topic, dds_instance_handle_t end) const {
  const std::lock_guard lock(mutex_);
  return ends_[topic].contains(end);
}

const ServiceMatches::End* ServiceMatches::find(Topic topic, const std::string& id) const {
  const auto found = std::find_if(ends_[topic].begin(), ends_[topic].end(),
                                  [&](const auto& end) { return end.second.id == id; });
  return found != ends_[topic].end() ? &found->second : nullptr;
}

std::size_t ServiceMatches::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(ends_[requests].begin(), ends_[requests].end(),
                    [this](const auto& end) { return find(responses, end.second.id) != nullptr; }));
}

bool ServiceMatches::called(std::uint64_t client, dds_instance_handle_t writer) {
  const std::lock_guard lock(mutex_);
  const auto known = clients_.find(writer);
  if (known != clients_.end() && known->second == client) return true;
  if (!ends_[requests].contains(writer)) return true;
  const bool was_another = known != clients_.end();
  if (was_another) {
    ++changed_callers_;
    forget_caller(writer);
  }
  if (callers_.try_emplace(client, writer).second) clients_[writer] = client;
  return !was_another;
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

ServiceMatches::Hearing ServiceMatches::hearing(std::uint64_t client) const {
  const std::lock_guard lock(mutex_);
  const auto caller = callers_.find(client);
  if (caller == callers_.end()) return Hearing::hears;
  const std::string& id = ends_[requests].at(caller->second).id;
  if (id.empty()) return Hearing::hears;
  const End* const reader = find(responses, id);
  if (reader == nullptr) return Hearing::absent;
  return reader->number <= confirmed_ ? Hearing::hears : Hearing::unknown;
}

std::uint64_t ServiceMatches::ends() const {
  const std::lock_guard lock(mutex_);
  return come_;
}

void ServiceMatches::confirm(std::uint64_t ends) {
  const std::lock_guard lock(mutex_);
  confirmed_ = std::max(confirmed_, ends);
}

}  // namespace takt
