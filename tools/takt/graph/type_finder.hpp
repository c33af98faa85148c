// Finds the types of messages that are on the graph.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TYPE_FINDER_HPP_
#define TAKT_TOOLS_TAKT_TYPE_FINDER_HPP_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/messages/described_types.hpp"

#include "graph/observer.hpp"

namespace takt::tools {

/// Knows a type if it is registered (ROS 2's common ones, and those of the libraries that --library
/// names), if AMENT_PREFIX_PATH leads to its definition, or if a node on the domain that uses it
/// answers `get_type_description`. The types live as long as the finder.
class TypeFinder {
 public:
  explicit TypeFinder(const Observer& observer) : observer_(observer) {}

  /// A message "std_msgs/msg/String", or one of a service or action, as
  /// "std_srvs/srv/Trigger_Request". Throws Error, which lists known types, if there is none.
  const MessageType& require(const std::string& name);
  /// The same without asking nodes; nullptr if there is none.
  const MessageType* find_here(const std::string& name);

 private:
  const MessageType* described(const TypeDescription& description, const std::string& name);
  const MessageType* ask_nodes(const std::string& name, const std::string& interface);
  std::optional<TypeDescription> ask(const std::string& service, const std::string& type,
                                     const std::string& hash);

  const Observer& observer_;
  bool has_discovered_ = false;
  std::vector<std::unique_ptr<DescribedTypes>> descriptions_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_TYPE_FINDER_HPP_
