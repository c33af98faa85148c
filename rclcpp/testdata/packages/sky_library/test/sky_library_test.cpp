// SPDX-License-Identifier: Apache-2.0
#include "sky_library/sky_library.hpp"

#include <gtest/gtest.h>

TEST(SkyLibrary, FindsTheLowest) {
  sky_interfaces::msg::Sky sky;
  sky.clouds.resize(2);
  sky.clouds[1].height = 3;
  EXPECT_EQ(sky_library::lowest(sky), 3);
}
