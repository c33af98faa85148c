// A component of a running container, for those who ask what there is.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LOADED_COMPONENT_HPP_
#define TAKT_CONTAINERS_LOADED_COMPONENT_HPP_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"

namespace takt {

struct LoadedComponent {
  std::uint64_t id = 0;  // 1, 2, … in the order of loading
  std::string name;      // of its node, with the namespace
  std::string type;
  SourceLine where;  // in the file
};

/// An error for each node whose name another one before it has. The file's reader has checked the
/// names that the file gives; here are those that only the code gives too.
std::vector<std::string> name_conflicts(std::span<const LoadedComponent> components);

}  // namespace takt

#endif  // TAKT_CONTAINERS_LOADED_COMPONENT_HPP_
