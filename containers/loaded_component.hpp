// Describes a component of a running container.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LOADED_COMPONENT_HPP_
#define TAKT_CONTAINERS_LOADED_COMPONENT_HPP_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace TAKT_PUBLIC takt {

struct LoadedComponent {
  std::uint64_t id = 0;  // 1, 2, … in the order of loading
  std::string name;      // of its node, with the namespace
  std::string type;
  SourceLine where;  // in the configuration file; empty: loaded on request
};

/// Returns an error for each node that has the name of an earlier one. The reader of the file
/// checks the names given there; this also finds names that the code of a component gives.
std::vector<std::string> name_conflicts(std::span<const LoadedComponent> components);

}  // namespace takt

#endif  // TAKT_CONTAINERS_LOADED_COMPONENT_HPP_
