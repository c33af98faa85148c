// The DDS domain that a command joins.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DOMAIN_OPTION_HPP_
#define TAKT_TOOLS_TAKT_DOMAIN_OPTION_HPP_

#include <optional>

#include "takt/transport/dds/participant.hpp"

namespace CLI {
class App;
}

namespace takt::tools {

/// --domain. ROS_DOMAIN_ID is read when a command asks for the domain, not when the options of all
/// commands are set up: a bad one must not end a command that joins no domain.
class DomainOption {
 public:
  void add_to(CLI::App& command);
  /// Throws an Error when it is not given, and ROS_DOMAIN_ID is no domain.
  int number() const { return given_ ? *given_ : default_domain(); }

 private:
  std::optional<int> given_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DOMAIN_OPTION_HPP_
