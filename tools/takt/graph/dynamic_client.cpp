// SPDX-License-Identifier: Apache-2.0
#include "graph/dynamic_client.hpp"

#include <cstring>
#include <utility>

#include "takt/entities/service_message.hpp"

#include "graph/dynamic_message.hpp"

namespace takt::tools {

// Node rejects the names of the client's topics, so the endpoints are made without it.
DynamicClient::DynamicClient(const Observer& observer, const std::string& service,
                             const MessageType& request, const MessageType& response,
                             std::function<void(const nlohmann::ordered_json&)> on_response)
    : identity_{new_service_id(kClientId), &request, &response},
      responses_(std::make_shared<GenericSubscription>(
          service, observer.node().default_callback_group(),
          Endpoint{reply_topic(service), &serialized_type(response.name), QoS(10),
                   observer.node().fully_qualified_name(), identity_},
          [&response, size = header_.size(), on_response = std::move(on_response)](
              std::span<const std::byte> bytes, const MessageInfo&) {
            on_response(read_message(response, bytes, {.skipped = size}));
          },
          observer.participant())),
      requests_({request_topic(service), &serialized_type(request.name), QoS(10),
                 observer.node().fully_qualified_name(), identity_},
                Clock::steady(), observer.participant()) {
  const std::uint64_t client = new_client_id();
  const std::int64_t sequence = 1;
  std::memcpy(header_.data(), &client, sizeof client);
  std::memcpy(header_.data() + sizeof client, &sequence, sizeof sequence);
  responses_->set_address(client);
  responses_->start();
}

}  // namespace takt::tools
