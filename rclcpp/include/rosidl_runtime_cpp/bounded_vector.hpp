// Sequences with a bound, under rosidl's name.
// SPDX-License-Identifier: Apache-2.0
#ifndef ROSIDL_RUNTIME_CPP__BOUNDED_VECTOR_HPP_
#define ROSIDL_RUNTIME_CPP__BOUNDED_VECTOR_HPP_

#include <cstddef>
#include <memory>
#include <vector>

#include "takt/messages/bounded.hpp"

namespace rosidl_runtime_cpp {

template <class T, std::size_t kMost, class Allocator = std::allocator<T>>
using BoundedVector = takt::Bounded<std::vector<T, Allocator>, kMost>;

}  // namespace rosidl_runtime_cpp

#endif  // ROSIDL_RUNTIME_CPP__BOUNDED_VECTOR_HPP_
