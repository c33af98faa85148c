// Registers a class of a base with this library.
// SPDX-License-Identifier: Apache-2.0
#ifndef CLASS_LOADER__REGISTER_MACRO_HPP_
#define CLASS_LOADER__REGISTER_MACRO_HPP_

#include <cstdio>

#define CLASS_LOADER_REGISTER_CLASS(Derived, Base) \
  static_assert(std::is_base_of_v<Base, Derived>); \
  static const int class_loader_registered = std::puts(#Derived);

#endif  // CLASS_LOADER__REGISTER_MACRO_HPP_
