// The keys of configuration files, as the code that reads them tells them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_REFERENCE_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_REFERENCE_HPP_

#include <string>
#include <vector>

namespace takt {

/// One key of a map. Texts are Markdown.
struct ReferenceKey {
  std::string key;
  std::string value;          // what may stand there; links lead to other sections
  std::string default_value;  // empty: none that can be written
  std::string meaning;
  bool is_required = false;
};

/// The keys of one kind of map, by the name that errors call it: "a thread".
struct ReferenceSection {
  std::string title;
  std::vector<ReferenceKey> keys;
};

/// What may stand in a configuration file, and in a workload in the iRobot format. A section comes
/// before those that it leads to.
std::vector<ReferenceSection> describe_configuration();
std::vector<ReferenceSection> describe_workload();
/// Keys of the design that are refused as not built yet.
std::vector<std::string> planned_keys();

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_REFERENCE_HPP_
