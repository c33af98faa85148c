// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/newcomers.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "takt/testing/peer_process.hpp"
#include "takt/transport/dds/ports.hpp"

namespace takt {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytes_of(std::initializer_list<int> values) {
  Bytes bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

// RTPS 2.5, 9.4: a header, a time stamp, and data of this writer.
Bytes datagram_of(std::array<int, 4> writer, bool is_little_endian = true) {
  Bytes bytes = bytes_of({'R', 'T', 'P', 'S', 2, 1, 1, 16});
  bytes.resize(20);
  const int flags = is_little_endian ? 1 : 0;
  const auto submessage = [&](int kind, std::initializer_list<int> body) {
    const int size = static_cast<int>(body.size());
    const Bytes header =
        is_little_endian ? bytes_of({kind, flags, size, 0}) : bytes_of({kind, flags, 0, size});
    bytes.insert(bytes.end(), header.begin(), header.end());
    const Bytes rest = bytes_of(body);
    bytes.insert(bytes.end(), rest.begin(), rest.end());
  };
  submessage(0x09, {0, 0, 0, 0, 0, 0, 0, 0});
  submessage(0x15, {0,         0,         16, 0, 0, 1, 0, 0xc7, writer[0], writer[1],
                    writer[2], writer[3], 0,  0, 0, 0, 1, 0,    0,         0});
  return bytes;
}

constexpr std::array kParticipants = {0, 1, 0, 0xc2}, kPublications = {0, 0, 3, 0xc2};

TEST(Newcomers, KnowAnAnnouncementOfAParticipant) {
  EXPECT_TRUE(is_announcement(datagram_of(kParticipants)));
  EXPECT_TRUE(is_announcement(datagram_of(kParticipants, /*is_little_endian=*/false)));
  EXPECT_FALSE(is_announcement(datagram_of(kPublications)));
  EXPECT_FALSE(is_announcement({}));
  const Bytes whole = datagram_of(kParticipants);
  for (std::size_t size = 0; size < whole.size() - 8; ++size) {  // without the writer
    EXPECT_FALSE(is_announcement(std::span(whole).first(size))) << size;
  }
  Bytes other = whole;
  other[0] = std::byte{'X'};
  EXPECT_FALSE(is_announcement(other));
}

class Port {
 public:
  explicit Port(int number) : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in here = at(number);
    is_free_ = bind(fd_, reinterpret_cast<const sockaddr*>(&here), sizeof here) == 0;
    const timeval most{.tv_sec = 20, .tv_usec = 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &most, sizeof most);
  }
  ~Port() { close(fd_); }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  bool is_free() const { return is_free_; }
  void send(const Bytes& bytes, int number) const {
    const sockaddr_in there = at(number);
    sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&there),
           sizeof there);
  }
  std::optional<Bytes> receive() const {
    Bytes bytes(1000);
    const ssize_t size = recv(fd_, bytes.data(), bytes.size(), 0);
    if (size < 0) return std::nullopt;
    bytes.resize(static_cast<std::size_t>(size));
    return bytes;
  }

 private:
  static sockaddr_in at(int number) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(number));
    return address;
  }
  const int fd_;
  bool is_free_ = false;
};

// One in ROS 2's range LOCALHOST announces itself to the indices 0 to 31 only, and only the first
// four processes of Takt had one of these.
TEST(Newcomers, ArePassedOnToAllProcessesOfTakt) {
  const int domain = test_domain();
  const Newcomers first(DiscoveryRange::localhost, domain, 40),
      second(DiscoveryRange::subnet, domain, 41);
  const Port of_first(discovery_port(domain, 40)), of_last(discovery_port(domain, kIndices - 1)),
      newcomer(0);
  ASSERT_TRUE(of_first.is_free() && of_last.is_free());
  for (const bool is_little : {true, false}) {
    const Bytes announcement = datagram_of(kParticipants, is_little);
    newcomer.send(datagram_of(kPublications), discovery_port(domain, kLastHeard));  // no newcomer
    newcomer.send(announcement, discovery_port(domain, kLastHeard));
    EXPECT_EQ(of_first.receive(), announcement);
    EXPECT_EQ(of_last.receive(), announcement);
  }
}

TEST(Newcomers, AreHeardByAnotherProcessWhenTheFirstHasGone) {
  const int domain = test_domain();
  const Newcomers stays(DiscoveryRange::localhost, domain, 41);
  const Port own(discovery_port(domain, 50)), newcomer(0);
  for (int round = 0; round < 20; ++round) {
    { const Newcomers goes(DiscoveryRange::localhost, domain, 40); }
    newcomer.send(datagram_of(kParticipants), discovery_port(domain, kLastHeard));
    ASSERT_EQ(own.receive(), datagram_of(kParticipants)) << round;
  }
}

std::set<std::string> threads_that_take_signals() {
  std::set<std::string> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream status(entry.path() / "status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("SigBlk:") && line.ends_with("0000000000000000")) {
        threads.insert(entry.path().filename());
      }
    }
  }
  return threads;
}

// SIGINT ended `takt topic echo` by its default action: the thread that hears newcomers had got it.
TEST(Newcomers, TakeNoSignalsOfTheProgram) {
  const std::set<std::string> before = threads_that_take_signals();
  EXPECT_FALSE(before.empty());
  const Newcomers some(DiscoveryRange::localhost, test_domain(), 40);
  EXPECT_EQ(threads_that_take_signals(), before);
}

TEST(Newcomers, LeaveTheIndexToOthersWhereNobodyIsHeard) {
  const int domain = test_domain();
  for (const DiscoveryRange range :
       {DiscoveryRange::off, DiscoveryRange::lo, DiscoveryRange::system}) {
    const Newcomers nobody(range, domain, 40);
    EXPECT_TRUE(Port(discovery_port(domain, kLastHeard)).is_free());
  }
  const Newcomers some(DiscoveryRange::subnet, domain, 40);
  EXPECT_FALSE(Port(discovery_port(domain, kLastHeard)).is_free());
}

}  // namespace
}  // namespace takt
