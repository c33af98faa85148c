// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/newcomers.hpp"

#include <chrono>
#include <cstring>
#include <string_view>

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "takt/base/blocked_signals.hpp"
#include "takt/transport/dds/ports.hpp"

namespace takt {
namespace {

// Limit: announcements of processes of ROS 2 that a process passes on in a second. At it: further
// ones are not passed on. Seen: these find Takt with its next announcement.
constexpr int kMostPassedOn = 200;
// Limit: bytes of an announcement of a process of ROS 2 that is passed on. At it: a longer one is
// not. Seen: the process finds Takt with its next announcement.
constexpr std::size_t kMostBytes = 8'192;

sockaddr_in address(std::uint32_t host, int port) noexcept {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(host);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

// Accepts only multicast of this machine, of which the kernel gives a copy marked as loopback.
bool keep_to_this_machine(int fd) noexcept {
  sock_filter is_of_this_machine[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<__u32>(SKF_AD_OFF + SKF_AD_PKTTYPE)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, UINT32_MAX), BPF_STMT(BPF_RET | BPF_K, 0)};
  const sock_fprog filter{std::size(is_of_this_machine), is_of_this_machine};
  return setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) == 0;
}

bool is_set(int fd, int option) noexcept {
  const int yes = 1;
  return setsockopt(fd, SOL_SOCKET, option, &yes, sizeof yes) == 0;
}

// On a port shared with other processes; for multicast, also with those of other users.
int shared_socket(int port, bool is_for_multicast) noexcept {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return fd;
  const sockaddr_in here = address(INADDR_ANY, port);
  const bool is_ready =
      (!is_for_multicast || (is_set(fd, SO_REUSEADDR) && keep_to_this_machine(fd))) &&
      is_set(fd, SO_REUSEPORT) &&
      bind(fd, reinterpret_cast<const sockaddr*>(&here), sizeof here) == 0;
  if (is_ready) return fd;
  close(fd);
  return -1;
}

// The first port that is free or used by other processes of this user.
int low_index_socket(int domain) noexcept {
  int fd = -1;
  for (int index = kLastHeard; fd < 0 && index >= kFirstHeard; --index) {
    fd = shared_socket(discovery_port(domain, index), /*is_for_multicast=*/false);
  }
  return fd;
}

}  // namespace

bool is_announcement(std::span<const std::byte> datagram) noexcept {
  constexpr std::string_view kProtocol = "RTPS";
  constexpr std::size_t kHeader = 20, kSubmessageHeader = 4;
  constexpr std::byte kData{0x15}, kLittleEndian{1};
  constexpr std::array kSpdpWriter = {std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0xc2}};
  constexpr std::size_t kWriterInData = 8;
  if (datagram.size() < kHeader || std::memcmp(datagram.data(), kProtocol.data(), 4) != 0) {
    return false;
  }
  for (auto rest = datagram.subspan(kHeader); rest.size() >= kSubmessageHeader;) {
    const bool is_little = (rest[1] & kLittleEndian) != std::byte{0};
    const auto size = std::to_integer<std::size_t>(rest[is_little ? 2 : 3]) +
                      (std::to_integer<std::size_t>(rest[is_little ? 3 : 2]) << 8);
    const auto body = rest.subspan(kSubmessageHeader);
    if (rest[0] == kData && body.size() >= kWriterInData + kSpdpWriter.size() &&
        std::memcmp(&body[kWriterInData], kSpdpWriter.data(), kSpdpWriter.size()) == 0) {
      return true;
    }
    if (size == 0 || size > body.size()) return false;  // the last submessage
    rest = body.subspan(size);
  }
  return false;
}

Newcomers::Socket::~Socket() {
  if (fd_ >= 0) close(fd_);
}

Newcomers::Newcomers(DiscoveryRange range, int domain, int participant_index)
    : domain_(domain),
      participant_index_(participant_index),
      multicast_(range == DiscoveryRange::localhost
                     ? shared_socket(multicast_port(domain), /*is_for_multicast=*/true)
                     : -1),
      low_index_(range == DiscoveryRange::localhost || range == DiscoveryRange::subnet
                     ? low_index_socket(domain)
                     : -1),
      stop_(multicast_.fd() >= 0 || low_index_.fd() >= 0 ? eventfd(0, EFD_CLOEXEC) : -1) {
  if (stop_.fd() < 0) return;
  const BlockedSignals in_its_thread;
  thread_ = std::thread([this] { hear_until_stopped(); });
}

Newcomers::~Newcomers() {
  if (!thread_.joinable()) return;
  eventfd_write(stop_.fd(), 1);
  thread_.join();
}

void Newcomers::hear_until_stopped() const noexcept {
  pthread_setname_np(pthread_self(), "newcomers");
  std::array<std::byte, kMostBytes> datagram;
  std::array<pollfd, 3> waits{
      {{stop_.fd(), POLLIN, 0}, {multicast_.fd(), POLLIN, 0}, {low_index_.fd(), POLLIN, 0}}};
  std::chrono::steady_clock::time_point second{};
  for (int passed_on = 0;;) {
    if (poll(waits.data(), waits.size(), -1) < 0) continue;
    if (waits[0].revents != 0) return;
    for (const Socket* from : {&multicast_, &low_index_}) {
      const ssize_t size =
          from->fd() < 0 ? -1 : recv(from->fd(), datagram.data(), datagram.size(), MSG_TRUNC);
      if (size <= 0 || static_cast<std::size_t>(size) > datagram.size()) continue;
      const std::span heard(datagram.data(), static_cast<std::size_t>(size));
      if (!is_announcement(heard)) continue;
      if (const auto now = std::chrono::steady_clock::now();
          now - second > std::chrono::seconds(1)) {
        second = now;
        passed_on = 0;
      }
      if (passed_on++ < kMostPassedOn) pass_on(*from, heard);
    }
  }
}

void Newcomers::pass_on(const Socket& from, std::span<const std::byte> heard) const noexcept {
  const auto send_to = [&](int index) {
    const sockaddr_in there = address(INADDR_LOOPBACK, discovery_port(domain_, index));
    sendto(from.fd(), heard.data(), heard.size(), MSG_DONTWAIT,
           reinterpret_cast<const sockaddr*>(&there), sizeof there);
  };
  if (&from == &multicast_) return send_to(participant_index_);
  for (int index = kLastOfRos2 + 1; index < kIndices; ++index) send_to(index);
}

}  // namespace takt
