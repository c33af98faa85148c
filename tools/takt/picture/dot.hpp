// The picture of a system in the language of graphviz.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DOT_HPP_
#define TAKT_TOOLS_TAKT_DOT_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// `graph` is of system_graph(). Processes and executors are boxes with their nodes in them; topics
/// are edges with type, rate and QoS; chains have colours, and what does not match is red.
std::string dot_text(const nlohmann::json& graph);

/// Throws Error if graphviz is not installed.
void check_graphviz();
/// Lays the text out with graphviz, as SVG for a light and a dark screen. Throws as check_graphviz.
std::string svg_of(const std::string& dot);

/// A page with the SVG, without scripts or anything from a network.
std::string picture_page(const nlohmann::json& graph, const std::string& svg);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DOT_HPP_
