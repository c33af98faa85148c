// Which processes a process discovers on its DDS domain.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_DISCOVERY_HPP_
#define TAKT_TRANSPORT_DDS_DISCOVERY_HPP_

#include <string>
#include <vector>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// The ranges of ROS 2 (REP 2016's successor, "Improved dynamic discovery" of Iron and later), and
/// one that is stricter.
enum class DiscoveryRange {
  /// The processes of this machine, those of ROS 2 included, and the static peers. Nothing leaves
  /// the machine, unless a process elsewhere has this one as its peer.
  localhost,
  /// Also all that multicast reaches.
  subnet,
  /// No other process.
  off,
  /// What Cyclone's defaults and CYCLONEDDS_URI say.
  system,
  /// The processes of this machine that use the loopback interface: Takt's, not ROS 2's. The kernel
  /// drops packets from all other interfaces.
  lo,
};

/// The range in the environment's ROS_AUTOMATIC_DISCOVERY_RANGE, else localhost; ROS_LOCALHOST_ONLY
/// overrules it, as in ROS 2. Throws Error when that is no range.
DiscoveryRange default_discovery();

/// The addresses in the environment's ROS_STATIC_PEERS, separated by semicolons; none under
/// ROS_LOCALHOST_ONLY. Throws Error when one cannot be an address.
std::vector<std::string> default_static_peers();

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_DISCOVERY_HPP_
