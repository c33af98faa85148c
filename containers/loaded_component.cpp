// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/loaded_component.hpp"

#include <string_view>
#include <unordered_map>

#include <fmt/format.h>

namespace takt {

std::vector<std::string> name_conflicts(std::span<const LoadedComponent> components) {
  std::unordered_map<std::string_view, const LoadedComponent*> by_name;
  std::vector<std::string> errors;
  for (const LoadedComponent& component : components) {
    const auto [first, is_new] = by_name.try_emplace(component.name, &component);
    if (is_new) continue;
    errors.push_back(
        Error(fmt::format("the node of '{}' is called '{}', as that of '{}' in {}", component.type,
                          component.name, first->second->type, first->second->where),
              "give each component its own name or namespace", component.where)
            .what());
  }
  return errors;
}

}  // namespace takt
