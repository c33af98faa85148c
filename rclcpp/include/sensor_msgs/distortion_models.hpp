// The names of the models of a lens.
// SPDX-License-Identifier: Apache-2.0
#ifndef SENSOR_MSGS__DISTORTION_MODELS_HPP_
#define SENSOR_MSGS__DISTORTION_MODELS_HPP_

namespace sensor_msgs::distortion_models {

inline constexpr char PLUMB_BOB[] = "plumb_bob";
inline constexpr char RATIONAL_POLYNOMIAL[] = "rational_polynomial";
inline constexpr char EQUIDISTANT[] = "equidistant";

}  // namespace sensor_msgs::distortion_models

#endif  // SENSOR_MSGS__DISTORTION_MODELS_HPP_
