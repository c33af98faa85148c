// Sends lines to a program that plots them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_UDP_STREAM_HPP_
#define TAKT_TOOLS_TAKT_UDP_STREAM_HPP_

#include <string>
#include <string_view>

namespace takt::tools::top {

/// Each line is a datagram. Whether anybody receives it is not known.
/// Thread safety: none. Real-time: no.
class UdpStream {
 public:
  // Limit: bytes of a datagram, by IPv4. At it: the line is not sent, and the command fails. Seen:
  // the error.
  static constexpr std::size_t kMostBytes = 65'507;

  /// `address`: "udp://HOST:PORT", "udp://[IPv6]:PORT". Throws UsageError if it is something else,
  /// or nobody knows the host.
  explicit UdpStream(const std::string& address);
  ~UdpStream();
  UdpStream(const UdpStream&) = delete;
  UdpStream& operator=(const UdpStream&) = delete;

  /// Throws Error if it cannot be sent.
  void send(std::string_view line);

 private:
  const std::string address_;
  int socket_ = -1;
};

}  // namespace takt::tools::top

#endif  // TAKT_TOOLS_TAKT_UDP_STREAM_HPP_
