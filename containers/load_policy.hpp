// Which libraries a container loads when it is asked to while it runs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LOAD_POLICY_HPP_
#define TAKT_CONTAINERS_LOAD_POLICY_HPP_

#include <string>
#include <vector>

namespace takt {

/// A library runs its code in the process that loads it, and every process on the DDS domain can
/// ask a container to load one. So only what its owner has named is loaded: in the component index,
/// in the configuration file, or here.
/// Thread safety: as a value.
/// Real-time: no; it reads the file system.
struct LoadPolicy {
  enum class Kind {
    off,    // no component, of whatever class
    index,  // what the component index knows, and the next two
    any,    // whatever is asked for
  };
  Kind kind = Kind::index;
  std::vector<std::string> libraries;  // named by the file; as real_library() returns them
  std::vector<std::string> folders;    // libraries in and below them; without links and `..`

  /// Throws Error when no component is loaded on request.
  void check() const;
  /// What to load when this library is asked for: with `index` its path without links and `..`, so
  /// that nothing else is loaded than what was compared. Throws Error when it may not be loaded, or
  /// is no file.
  std::string permitted(const std::string& library) const;
};

/// The path of a library without symbolic links and `..`, whether or not it exists; empty when it
/// cannot be followed. A name without a slash is the dynamic linker's to find, and stays as it is.
std::string real_library(const std::string& library);

/// The path of a folder that exists, without symbolic links and `..`; else throws Error.
std::string real_folder(const std::string& folder);

/// What an option says: `off`, `index`, `any`, or a folder, of which there may be several. Throws
/// Error for a folder that does not exist, and for a word that does not stand alone.
LoadPolicy parse_load_policy(const std::vector<std::string>& words);

}  // namespace takt

#endif  // TAKT_CONTAINERS_LOAD_POLICY_HPP_
