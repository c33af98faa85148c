// Hears processes of ROS 2 that look for others, so that these find this process at once.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_NEWCOMERS_HPP_
#define TAKT_TRANSPORT_DDS_NEWCOMERS_HPP_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <thread>

#include "takt/base/visibility.hpp"
#include "takt/transport/dds/discovery.hpp"

namespace TAKT_INTERNAL takt {

/// A process of ROS 2 that begins announces itself where Cyclone does not hear it here: by
/// multicast, which does not come to the range `localhost`; or, in its own range LOCALHOST, to the
/// participant indices 0 to 31, which are ROS 2's. Cyclone answers at once what it hears.
/// 1. Under `localhost` a socket hears the multicast of this machine. No group is joined: the
///    newcomer has joined it, and a socket that has joined none hears each group of its machine.
///    What comes from other machines the kernel drops. What is heard goes to our own Cyclone.
/// 2. One of the indices 31 to 28 is not ROS 2's: the processes of Takt of one user share its port
///    (SO_REUSEPORT), of which the kernel gives each datagram to one of them. That one passes it on
///    to the ports of all indices of Takt. When it ends, another one gets the next datagram.
/// So nobody has to announce itself again and again for newcomers. What is lost here is found with
/// the next announcement, which a lease needs anyway.
/// Thread safety: belongs to the domain. It has a thread, which sleeps until a datagram comes.
/// Real-time: no. The thread inherits the attributes of the one that makes it, as Cyclone's do.
class Newcomers {
 public:
  /// Only `localhost` and `subnet` have newcomers that Cyclone does not hear. Where a socket cannot
  /// be had, that way of theirs is not heard.
  Newcomers(DiscoveryRange range, int domain, int participant_index);
  ~Newcomers();
  Newcomers(const Newcomers&) = delete;
  Newcomers& operator=(const Newcomers&) = delete;

 private:
  class Socket {
   public:
    explicit Socket(int fd = -1) noexcept : fd_(fd) {}
    ~Socket();
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;
    int fd() const noexcept { return fd_; }

   private:
    const int fd_;
  };

  void hear_until_stopped() const noexcept;
  void pass_on(const Socket& from, std::span<const std::byte> announcement) const noexcept;

  const int domain_, participant_index_;
  const Socket multicast_, low_index_, stop_;
  std::thread thread_;
};

/// Whether the datagram announces a participant (RTPS 2.5, 8.3.4 and 9.6.1.4).
bool is_announcement(std::span<const std::byte> datagram) noexcept;

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_NEWCOMERS_HPP_
