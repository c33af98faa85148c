// Variables of the environment.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCPPUTILS__ENV_HPP_
#define RCPPUTILS__ENV_HPP_

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace rcpputils {

/// Empty when the variable is not set.
inline std::string get_env_var(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

/// A `value` of nullptr unsets the variable. Throws std::runtime_error for an invalid name.
inline bool set_env_var(const char* name, const char* value) {
  if ((value != nullptr ? setenv(name, value, 1) : unsetenv(name)) == 0) return true;
  throw std::runtime_error("no name of a variable: '" + std::string(name) + "'");
}

}  // namespace rcpputils

#endif  // RCPPUTILS__ENV_HPP_
