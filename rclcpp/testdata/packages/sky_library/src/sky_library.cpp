// SPDX-License-Identifier: Apache-2.0
#include "sky_library/sky_library.hpp"

#include <algorithm>

namespace sky_library {

double lowest(const sky_interfaces::msg::Sky& sky) {
  double height = 1e9;
  for (const auto& cloud : sky.clouds) height = std::min(height, cloud.height);
  return height;
}

}  // namespace sky_library
