// Uses the messages of its own package, in the ways in which programs for rclcpp do.
// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "rosidl_runtime_cpp/bounded_vector.hpp"
#include "rosidl_runtime_cpp/message_initialization.hpp"
#include "rosidl_runtime_cpp/traits.hpp"
#include "sky_interfaces/action/watch.hpp"
#include "sky_interfaces/msg/cloud.h"  // of C, which some packages include beside their own
#include "sky_interfaces/msg/sky.hpp"
#include "sky_interfaces/srv/count.hpp"
#include "std_msgs/msg/header.h"
#include "std_msgs/msg/header.hpp"

using sky_interfaces::msg::Cloud;
using sky_interfaces::msg::Sky;

static_assert(
    std::is_same_v<decltype(Sky::low_clouds), rosidl_runtime_cpp::BoundedVector<Cloud, 2>>);
static_assert(std::is_same_v<decltype(Sky::wind), std::array<double, 3>>);
static_assert(rosidl_generator_traits::is_message<Sky>::value);
static_assert(!rosidl_generator_traits::is_message<sky_interfaces::srv::Count>::value);
static_assert(rosidl_generator_traits::is_service<sky_interfaces::srv::Count>::value);
static_assert(rosidl_generator_traits::is_action<sky_interfaces::action::Watch>::value);
static_assert(rosidl_generator_traits::has_fixed_size<Cloud>::value);

int main() {
  Sky sky{rosidl_runtime_cpp::MessageInitialization::ALL};
  sky.header = std_msgs::msg::Header().set__frame_id("earth");
  sky.low_clouds.push_back(Cloud().set__kind(Cloud::KIND_CIRRUS));
  sky.low_clouds.emplace_back();
  try {
    sky.low_clouds.push_back({});
  } catch (const std::length_error&) {
    std::cout << u8"two fit in\n";  // which C++20 refuses
  }
  const Sky::ConstSharedPtr shared = std::make_shared<Sky>(sky);
  const auto request = std::make_shared<sky_interfaces::srv::Count::Request>();
  request->kind = Cloud::UNIT;
  sky_interfaces::action::Watch::Result::SharedPtr result =
      std::make_shared<sky_interfaces::action::Watch::Result>();
  result->seen.push_back(*shared);
  std::cout << (result->seen.front() == sky && *shared != Sky()) << " " << request->kind << " "
            << rosidl_generator_traits::name<Sky>() << " "
            << rosidl_generator_traits::data_type<sky_interfaces::srv::Count>() << "\n"
            << sky_interfaces::msg::to_yaml(shared->low_clouds.front(), true) << "\n"
            << rosidl_generator_traits::to_yaml(shared->header);
}
