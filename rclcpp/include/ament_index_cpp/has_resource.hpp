// See get_resource.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef AMENT_INDEX_CPP__HAS_RESOURCE_HPP_
#define AMENT_INDEX_CPP__HAS_RESOURCE_HPP_

#include "ament_index_cpp/get_resource.hpp"

#endif  // AMENT_INDEX_CPP__HAS_RESOURCE_HPP_
