// What the constructor of a container plans and checks. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_PLAN_HPP_
#define TAKT_CONTAINERS_CONTAINER_PLAN_HPP_

#include <memory>
#include <vector>

#include "takt/containers/container_executors.hpp"

namespace takt {

/// Makes the plan of the components, and its chains.
std::vector<std::shared_ptr<Chain>> make_chains(ContainerSetting& setting,
                                                ComponentList& components);
/// Applies Takt's assignments where the file gives no value. If the file has `priorities`, they
/// override the priorities set in the code.
void assign(ContainerSetting& setting, ComponentList& components);
/// Checks that the callbacks named by executors exist.
void check_listed_callbacks(ContainerSetting& setting, const ComponentList& components,
                            const ContainerExecutors& executors);
/// Checks the modes of the file against the components, which no executor has yet, and installs the
/// overrun handlers that switch to a mode.
void prepare_modes(ContainerSetting& setting, const ComponentList& components,
                   const ContainerExecutors& executors);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_PLAN_HPP_
