// Which UDP ports RTPS gives to a DDS domain.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_PORTS_HPP_
#define TAKT_TRANSPORT_DDS_PORTS_HPP_

namespace takt {

/// RTPS 2.5, 9.6.2.3: each domain has so many, from the first one on.
inline constexpr int kFirstPort = 7400, kPortsOfDomain = 250;

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_PORTS_HPP_
