// Reports of a process about its container: endpoints and nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CONTAINER_JSON_HPP_
#define TAKT_TOOLS_TAKT_CONTAINER_JSON_HPP_

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/container.hpp"

namespace takt::tools {

nlohmann::json endpoints_json(const Container& container);

/// The endpoints for the results: those of topics, without services.
void add_topics(nlohmann::json& topics, const std::string& process,
                const nlohmann::json& endpoints);

nlohmann::json nodes_json(const Container& container);

/// Throws ConfigurationError if nodes have the same name.
void check_names(const std::vector<nlohmann::json>& processes);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CONTAINER_JSON_HPP_
