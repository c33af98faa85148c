// Where packages are installed.
// SPDX-License-Identifier: Apache-2.0
#ifndef AMENT_INDEX_CPP__GET_PACKAGE_PREFIX_HPP_
#define AMENT_INDEX_CPP__GET_PACKAGE_PREFIX_HPP_

#include <stdexcept>
#include <string>

namespace ament_index_cpp {

struct PackageNotFoundError : std::out_of_range {
  explicit PackageNotFoundError(const std::string& package);
  std::string package_name;
};

/// The first of the prefixes in AMENT_PREFIX_PATH that has the package, or else the one in which
/// this program is installed. Throws PackageNotFoundError.
std::string get_package_prefix(const std::string& package);

}  // namespace ament_index_cpp

#endif  // AMENT_INDEX_CPP__GET_PACKAGE_PREFIX_HPP_
