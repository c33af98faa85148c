// SPDX-License-Identifier: Apache-2.0
#include "sky_library/sky_library.hpp"

double height_of_one_cloud() {
  sky_interfaces::msg::Sky sky;
  sky.clouds.emplace_back();
  return sky_library::lowest(sky);
}
