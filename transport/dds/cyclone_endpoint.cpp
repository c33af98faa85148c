// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/cyclone_endpoint.hpp"

#include <algorithm>
#include <iterator>
#include <random>
#include <utility>
#include <vector>

#include <dds/ddsc/dds_loan_api.h>
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/never_destroyed.hpp"
#include "takt/transport/dds/cyclone_participant.hpp"

namespace takt {

CycloneEndpoint::CycloneEndpoint(CycloneParticipant& participant, const Endpoint& endpoint,
                                 bool is_writer)
    : participant_(participant.shared_from_this()),
      endpoint_(endpoint),
      is_writer_(is_writer),
      is_service_(endpoint.identity.id.starts_with(kServiceId)),
      why_udp_(participant.why_udp(endpoint, is_writer)),
      services_(participant.service_matches(endpoint.identity.id)),
      topic_(participant.handle(), endpoint, is_shared()),
      number_(next_sequence()) {
}

CycloneEndpoint::~CycloneEndpoint() {
  if (is_shared()) {
    participant_->remove(handle_);
  } else {
    participant_->let_go(handle_, std::move(topic_), is_writer_);
  }
}

void CycloneEndpoint::close() noexcept {
  participant_->remove(*this, endpoint_, handle_);
  dds_set_listener(handle_, nullptr);  // waits for a running callback
}

void CycloneEndpoint::make(decltype(&dds_create_writer) create, std::size_t depth,
                           const Listener& listener) {
  // With DDS ignore-local QoS, Cyclone gives a reader no shared memory: then the reader drops
  // messages of its own process itself.
  const bool ignores_own_process = !is_shared() && !participant_->serves_own_process();
  const WireQoS qos = wire_qos(endpoint_.qos, depth);
  if (ignores_own_process) dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  const std::string text =
      user_data(endpoint_, participant_->ros_graph(), participant_->discovered_hash(endpoint_));
  dds_qset_userdata(qos.get(), text.data(), text.size());
  handle_ = dds_check(
      create(participant_->handle(), topic_.handle(), qos.get(), listener.get()),
      fmt::format("no DDS {} for topic '{}'", is_writer_ ? "writer" : "reader", endpoint_.topic));
  if (is_shared() && !dds_is_loan_available(handle_)) {
    dds_delete(std::exchange(handle_, 0));
    throw Error("Cyclone DDS gives no shared memory to topic '" + endpoint_.topic + "'");
  }
  if (is_shared()) count_matched(handle_, matched_.load(), 0);
  if (services_ != nullptr) {
    const std::lock_guard lock(counting_);
    for (const auto other : matched_ends(handle_)) note(handle_, other, 1);
  }
  participant_->add(*this, endpoint_, handle_, is_writer_);
}

// Empty while the endpoint is being made or deleted.
std::vector<dds_instance_handle_t> CycloneEndpoint::matched_ends(
    dds_entity_t handle) const noexcept {
  std::vector<dds_instance_handle_t> others(16);
  for (;;) {
    const dds_return_t found =
        is_writer_ ? dds_get_matched_subscriptions(handle, others.data(), others.size())
                   : dds_get_matched_publications(handle, others.data(), others.size());
    const bool all = found <= static_cast<dds_return_t>(others.size());
    others.resize(static_cast<std::size_t>(std::max(found, 0)));
    if (all) return others;
  }
}

// Runs on a thread of Cyclone, or on the thread that makes an endpoint.
void CycloneEndpoint::count_matched(dds_entity_t handle, std::size_t count, int change) noexcept {
  if (!is_shared() || participant_->serves_own_process()) {
    matched_.store(count);
    if (change != 0) events().matched(change);
    return;
  }
  // Cyclone also counts endpoints of our own participant.
  const std::lock_guard lock(counting_);  // the thread that stores last also looked last
  const auto others = matched_ends(handle);
  dds_instance_handle_t own = 0;
  dds_get_instance_handle(participant_->handle(), &own);
  count = static_cast<std::size_t>(std::count_if(others.begin(), others.end(), [&](auto other) {
    auto* data = is_writer_ ? dds_get_matched_subscription_data(handle, other)
                            : dds_get_matched_publication_data(handle, other);
    const bool is_outside = data != nullptr && data->participant_instance_handle != own;
    if (data != nullptr) dds_builtintopic_free_endpoint(data);
    return is_outside;
  }));
  change = static_cast<int>(count) - static_cast<int>(matched_.exchange(count));
  if (change != 0) events().matched(change);
}

void CycloneEndpoint::note_match(dds_entity_t handle, dds_instance_handle_t other,
                                 int change) noexcept {
  if (services_ == nullptr) return;
  const std::lock_guard lock(counting_);
  note(handle, other, change);
}

void CycloneEndpoint::note(dds_entity_t handle, dds_instance_handle_t other, int change) noexcept {
  const auto topic =
      is_service_ == is_writer_ ? ServiceMatches::responses : ServiceMatches::requests;
  if (change < 0) return services_->remove(topic, other);
  auto* data = is_writer_ ? dds_get_matched_subscription_data(handle, other)
                          : dds_get_matched_publication_data(handle, other);
  if (data == nullptr) return;  // the other has gone, or we are being made
  services_->add(topic, other, user_data_value(*data->qos, is_service_ ? kClientId : kServiceId));
  dds_builtintopic_free_endpoint(data);
}

void put_away(std::unique_ptr<CycloneEndpoint> gone) {
  static std::mutex mutex;
  static detail::NeverDestroyed<std::vector<std::unique_ptr<CycloneEndpoint>>> all;
  auto& waiting = *all;
  std::vector<std::unique_ptr<CycloneEndpoint>> idle;  // destroyed after the unlock
  const std::lock_guard lock(mutex);
  if (gone != nullptr) waiting.push_back(std::move(gone));
  const auto first = std::partition(waiting.begin(), waiting.end(),
                                    [](const auto& endpoint) { return !endpoint->is_idle(); });
  std::move(first, waiting.end(), std::back_inserter(idle));
  waiting.erase(first, waiting.end());
}

std::uint64_t random_number() {
  std::random_device random;
  return std::uint64_t{random()} << 32 | random();
}

}  // namespace takt
