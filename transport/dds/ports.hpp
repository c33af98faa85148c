// Which UDP ports RTPS gives to a DDS domain, and which of them are Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_PORTS_HPP_
#define TAKT_TRANSPORT_DDS_PORTS_HPP_

namespace takt {

/// RTPS 2.5, 9.6.2.3: each domain has so many, from the first one on, which is for multicast.
inline constexpr int kFirstPort = 7400, kPortsOfDomain = 250;
/// From where in its domain the ports of a participant are: one for discovery, and the next one.
inline constexpr int kFirstUnicastPort = 10;
/// The ports of higher participant indices are the next domain's.
inline constexpr int kIndices = 119;
/// rmw_cyclonedds announces a process to the indices 0 to 31, and takes none above 32.
inline constexpr int kLastOfRos2 = 32;
/// On one of these Takt hears them, see newcomers.hpp. No process has one as its own.
inline constexpr int kFirstHeard = 28, kLastHeard = 31;

constexpr int multicast_port(int domain) noexcept {
  return kFirstPort + kPortsOfDomain * domain;
}
constexpr int discovery_port(int domain, int participant_index) noexcept {
  return multicast_port(domain) + kFirstUnicastPort + 2 * participant_index;
}

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_PORTS_HPP_
