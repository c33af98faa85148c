// The addresses that a publisher or subscription uses; Takt does not report them.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NETWORK_FLOW_ENDPOINT_HPP_
#define RCLCPP__NETWORK_FLOW_ENDPOINT_HPP_

#include <cstdint>
#include <ostream>
#include <string>

namespace rclcpp {

/// get_network_flow_endpoints() throws exceptions::RCLError, as rclcpp does over an RMW without
/// this feature.
class NetworkFlowEndpoint {
 public:
  const std::string& transport_protocol() const { return protocol_; }
  const std::string& internet_address() const { return address_; }
  std::uint16_t transport_port() const { return port_; }
  friend bool operator==(const NetworkFlowEndpoint&, const NetworkFlowEndpoint&) = default;

 private:
  std::string protocol_, address_;
  std::uint16_t port_ = 0;
};
inline std::ostream& operator<<(std::ostream& stream, const NetworkFlowEndpoint& endpoint) {
  return stream << endpoint.transport_protocol() << "://" << endpoint.internet_address() << ":"
                << endpoint.transport_port();
}

}  // namespace rclcpp

#endif  // RCLCPP__NETWORK_FLOW_ENDPOINT_HPP_
