// SPDX-License-Identifier: Apache-2.0
#include "sky_library/sky_library.hpp"

#include <algorithm>

#include "sky_library/version.h"

namespace sky_library {

static_assert(SKY_LIBRARY_VERSION_MINOR == 1 && SKY_LIBRARY_VERSION_GTE(0, 0, 9) &&
              SKY_LIBRARY_VERSION_GTE(0, 1, 0) && !SKY_LIBRARY_VERSION_GTE(0, 1, 1) &&
              !SKY_LIBRARY_VERSION_GTE(1, 0, 0));

double lowest(const sky_interfaces::msg::Sky& sky) {
  double height = 1e9;
  for (const auto& cloud : sky.clouds) height = std::min(height, cloud.height);
  return height;
}

}  // namespace sky_library
