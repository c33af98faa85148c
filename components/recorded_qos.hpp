// The QoS of publishers in recordings, as ROS 2 writes it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_RECORDED_QOS_HPP_
#define TAKT_COMPONENTS_RECORDED_QOS_HPP_

#include <string>

#include "takt/transport/qos.hpp"

namespace takt {

/// YAML with the numbers of ROS 2's enumerations: versions of rosbag2 since Foxy read it.
std::string to_recorded_qos(const QoS& qos);
/// What a player offers for it: reliability and durability, and a depth for bursts. Text that is no
/// such YAML, or empty, is the default of publishers.
QoS from_recorded_qos(const std::string& text);

}  // namespace takt

#endif  // TAKT_COMPONENTS_RECORDED_QOS_HPP_
