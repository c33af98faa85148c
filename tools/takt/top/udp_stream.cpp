// SPDX-License-Identifier: Apache-2.0
#include "top/udp_stream.hpp"

#include <cerrno>
#include <charconv>
#include <cstdint>
#include <memory>

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"

#include "exit_status.hpp"

namespace takt::tools::top {
namespace {

constexpr std::string_view kScheme = "udp://";

struct HostAndPort {
  std::string host, port;
};

HostAndPort read_address(const std::string& address) {
  const auto refuse = [&]() -> HostAndPort {
    throw UsageError(fmt::format("'{}' is no address for a stream", printable(address)),
                     "write udp://HOST:PORT, as udp://127.0.0.1:9870; into a file goes "
                     "takt top --json > FILE");
  };
  const std::size_t colon = address.rfind(':');
  if (!address.starts_with(kScheme) || colon < kScheme.size()) return refuse();
  std::string host = address.substr(kScheme.size(), colon - kScheme.size());
  const std::string port = address.substr(colon + 1);
  std::uint16_t number = 0;
  const auto [stop, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc{} || stop != port.data() + port.size() || number == 0) return refuse();
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  if (host.empty() || host.find_first_of("/[]") != std::string::npos) return refuse();
  return {host, port};
}

}  // namespace

UdpStream::UdpStream(const std::string& address) : address_(address) {
  const auto [host, port] = read_address(address);
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0) {
    throw UsageError(fmt::format("the host '{}' of the stream is not known: {}", printable(host),
                                 gai_strerror(error)),
                     "write its address, as udp://127.0.0.1:9870");
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> first(found, &freeaddrinfo);
  socket_ = socket(first->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_ < 0 || connect(socket_, first->ai_addr, first->ai_addrlen) != 0) {
    const std::string why = errno_message(errno);
    if (socket_ >= 0) close(socket_);
    throw Error(fmt::format("nothing can be sent to {}: {}", address, why));
  }
}

UdpStream::~UdpStream() {
  close(socket_);
}

// That nobody has received the one before is reported here, too: a program that plots may begin
// later, and a network may come back.
void UdpStream::send(std::string_view line) {
  if (line.size() > kMostBytes) {
    throw Error(
        fmt::format("a line has {} bytes, and a datagram {} at most", line.size(), kMostBytes),
        "name the containers that you want to see: takt top CONTAINER --stream …");
  }
  for (int i = 0; i < 2; ++i) {
    if (::send(socket_, line.data(), line.size(), MSG_NOSIGNAL) >= 0) return;
    const int error = errno;
    const bool may_pass = error == ECONNREFUSED || error == EINTR || error == ENETUNREACH ||
                          error == EHOSTUNREACH || error == ENETDOWN || error == ENOBUFS ||
                          error == EACCES || error == EPERM;
    if (!may_pass) break;
    if (i == 1) return;
  }
  throw Error(fmt::format("nothing can be sent to {}: {}", address_, errno_message(errno)));
}

}  // namespace takt::tools::top
