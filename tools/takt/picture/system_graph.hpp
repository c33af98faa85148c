// What `takt graph` draws, as JSON: the system of a file, or what runs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SYSTEM_GRAPH_HPP_
#define TAKT_TOOLS_TAKT_SYSTEM_GRAPH_HPP_

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// As graph_json(). Constructs the components of the file's processes, one after another, without
/// network: nothing runs. Topics that every node has are left out. Throws Error as Container does.
nlohmann::json system_graph(const std::string& file);

struct RunningGraph {
  nlohmann::json graph;             // as graph_json()
  std::vector<std::string> silent;  // containers that have not said what they are made of
};
/// These containers, and whatever shares topics with them; without names, all that is on the
/// domain. Throws Error if there is none of a name, or nothing at all.
RunningGraph running_graph(const std::vector<std::string>& containers, int domain);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SYSTEM_GRAPH_HPP_
