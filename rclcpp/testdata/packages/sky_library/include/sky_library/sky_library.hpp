// SPDX-License-Identifier: Apache-2.0
#ifndef SKY_LIBRARY__SKY_LIBRARY_HPP_
#define SKY_LIBRARY__SKY_LIBRARY_HPP_

#include "sky_interfaces/msg/sky.hpp"

namespace sky_library {

double lowest(const sky_interfaces::msg::Sky& sky);

}  // namespace sky_library

#endif  // SKY_LIBRARY__SKY_LIBRARY_HPP_
