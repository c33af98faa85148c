// The reference of configuration keys, generated from the tables that the reader uses.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_REFERENCE_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_REFERENCE_HPP_

#include <string>
#include <vector>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// One key of a map. Texts are Markdown.
struct ReferenceKey {
  std::string key;
  std::string value;          // the permitted values, with links to other sections
  std::string default_value;  // empty: no default that could be written in a file
  std::string meaning;
  bool is_required = false;
};

/// The keys of one kind of map. Its title is its name in error messages: "a thread".
struct ReferenceSection {
  std::string title;
  std::vector<ReferenceKey> keys;
};

/// Describe the keys of a configuration file, and of a workload in the iRobot format. A section
/// precedes the sections that it links to.
std::vector<ReferenceSection> describe_configuration();
std::vector<ReferenceSection> describe_workload();

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_REFERENCE_HPP_
