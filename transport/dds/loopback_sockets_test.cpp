// From where Cyclone's sockets receive.
// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "takt/transport/dds/participant.hpp"

namespace takt {
namespace {

using testing::Each;
using testing::IsEmpty;
using testing::Not;
using testing::Pair;

// The interface of each socket of this process that takes datagrams to any address, by its port.
std::map<int, std::string> open_sockets(int domain) {
  std::map<int, std::string> sockets;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int fd = std::stoi(entry.path().filename());
    sockaddr_in address{};
    socklen_t size = sizeof(address);
    if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
        address.sin_family != AF_INET || address.sin_addr.s_addr != htonl(INADDR_ANY)) {
      continue;
    }
    const int port = ntohs(address.sin_port);
    if (port < 7400 + 250 * domain || port >= 7400 + 250 * (domain + 1)) continue;
    char interface[IFNAMSIZ] = "";
    size = sizeof(interface);
    getsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, interface, &size);
    sockets[port] = interface;
  }
  return sockets;
}

TEST(DiscoveryRange, LoMeansThatNothingIsReceivedFromOtherInterfaces) {
  constexpr int kClosed = 211, kOpen = 212;
  const auto closed = Participant::create({.domain = kClosed, .discovery = DiscoveryRange::lo});
  EXPECT_THAT(open_sockets(kClosed), Not(IsEmpty()));
  EXPECT_THAT(open_sockets(kClosed), Each(Pair(testing::_, "lo")));
  const auto open = Participant::create({.domain = kOpen, .discovery = DiscoveryRange::subnet});
  EXPECT_THAT(open_sockets(kOpen), Not(IsEmpty()));
  EXPECT_THAT(open_sockets(kOpen), Each(Pair(testing::_, "")));
  EXPECT_THAT(open_sockets(kClosed), Each(Pair(testing::_, "lo")));
}

}  // namespace
}  // namespace takt
