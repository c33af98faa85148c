// Standard headers that rclcpp's have, for programs that rely on getting them from there.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__STANDARD_HEADERS_HPP_
#define RCLCPP__DETAIL__STANDARD_HEADERS_HPP_

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <codecvt>
#include <csignal>
#include <deque>
#include <functional>
#include <iomanip>
#include <iostream>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <queue>
#include <set>
#include <shared_mutex>
#include <sstream>
#include <string>
#include <thread>
#include <typeindex>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <cxxabi.h>
#include <math.h>  // NOLINT: programs call atan2() without std::

#endif  // RCLCPP__DETAIL__STANDARD_HEADERS_HPP_
