// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/loopback_sockets.hpp"

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "takt/transport/dds/ports.hpp"

namespace takt {
namespace {

// Cyclone does not expose its sockets, but their ports are known.
bool receives_from_everywhere(int fd, int domain) {
  int type = 0;
  socklen_t size = sizeof(type);
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return false;
  sockaddr_in address{};
  size = sizeof(address);
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return false;
  return address.sin_family == AF_INET && address.sin_addr.s_addr == htonl(INADDR_ANY) &&
         (ntohs(address.sin_port) - kFirstPort) / kPortsOfDomain == domain;
}

}  // namespace

std::string keep_on_loopback(int domain) {
  constexpr char kLoopback[] = "lo";
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const std::string name = entry.path().filename();
    int fd = -1;
    std::from_chars(name.data(), name.data() + name.size(), fd);
    if (!receives_from_everywhere(fd, domain)) continue;
    if (setsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, kLoopback, sizeof(kLoopback)) != 0) {
      return fmt::format("its sockets receive from all interfaces: SO_BINDTODEVICE: {}",
                         std::strerror(errno));
    }
  }
  return {};
}

}  // namespace takt
