// The libraries that a running container may load on request, and the rights of such components.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_LOAD_POLICY_HPP_
#define TAKT_CONTAINERS_LOAD_POLICY_HPP_

#include <string>
#include <vector>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A library runs code in the process that loads it, and every process on the DDS domain can send a
/// load request. So a container loads only libraries that its owner has named: in the component
/// index, in the configuration file, or here.
/// Thread safety: none, as for any value.
/// Real-time: no; it reads the file system.
struct LoadPolicy {
  enum class Kind {
    off,    // nothing, not even a class that is registered already
    index,  // libraries in the component index, in `libraries` and in `folders`
    any,    // every library
  };
  Kind kind = Kind::index;
  bool is_given = false;  // the owner states the policy, in the file or by an option
  // See privileges(). Not empty: nothing is loaded, as the owner has not allowed it with these
  // rights.
  std::string privileges;
  std::string recordings;              // folder of the files that components may use; empty: none
  std::vector<std::string> libraries;  // named in the file; as real_library() returns them
  std::vector<std::string> folders;    // with their subfolders; as real_folder() returns them

  /// Throws Error if nothing may be loaded.
  void check() const;
  /// Returns the path to load for a requested library. With `index` it is free of links and `..`:
  /// otherwise a link could change between the check and the load. Throws Error if the policy
  /// forbids the library, if it is no file, or if others can change a folder on the way to it.
  std::string permitted(const std::string& library) const;
};

/// Resolves symbolic links and `..` in the path of a library, which need not exist. Returns an
/// empty string on error. A name without a slash is returned as it is: the dynamic linker searches
/// it.
std::string real_library(const std::string& library);

/// Resolves symbolic links and `..` in the path of a folder. Throws Error if it does not exist.
std::string real_folder(const std::string& folder);

/// Reads the values of two options. The first: one of `off`, `index` and `any`, or one or more
/// folders. The second: a folder. Throws Error for a folder that does not exist or that every user
/// can change, and for a word that is combined with other values.
LoadPolicy parse_load_policy(const std::vector<std::string>& words,
                             const std::string& recordings = {});

/// Which rights this thread has that other users lack, except those for real time: "runs as root".
/// Empty: none.
std::string privileges();

}  // namespace takt

#endif  // TAKT_CONTAINERS_LOAD_POLICY_HPP_
