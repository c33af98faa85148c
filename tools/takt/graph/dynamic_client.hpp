// A client of a service whose types are known by their descriptions.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DYNAMIC_CLIENT_HPP_
#define TAKT_TOOLS_TAKT_DYNAMIC_CLIENT_HPP_

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "takt/entities/generic_publisher.hpp"
#include "takt/entities/generic_subscription.hpp"

#include "graph/observer.hpp"

namespace takt::tools {

/// Sends one request. The types and the observer's node outlive it.
class DynamicClient {
 public:
  /// `on_response` is called with the fields when responses() is executed.
  DynamicClient(const Observer& observer, const std::string& service, const MessageType& request,
                const MessageType& response,
                std::function<void(const nlohmann::ordered_json&)> on_response);

  /// Precedes the fields of the request.
  std::span<const std::byte> header() const noexcept { return header_; }
  /// Whether a service would receive the request now, and its response would arrive.
  bool service_is_ready() const noexcept {
    return requests_.subscription_count() != 0 && responses_->outside_publisher_count() != 0;
  }
  void send(std::span<const std::byte> request) { requests_.publish(request); }
  const std::shared_ptr<GenericSubscription>& responses() const noexcept { return responses_; }

 private:
  const ServiceIdentity identity_;
  const std::shared_ptr<GenericSubscription> responses_;
  GenericPublisher requests_;
  std::array<std::byte, 16> header_{};  // the client's id, and the number of the request
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DYNAMIC_CLIENT_HPP_
