// Loads shared libraries that register schedulers or components.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LIBRARY_HPP_
#define TAKT_BASE_LIBRARY_HPP_

#include <any>
#include <string>
#include <string_view>
#include <vector>

namespace takt {

/// A registration by a static initialiser of a library. An exception must not leave a static
/// initialiser, so the entry is only recorded, and checked after loading.
struct Registration {
  std::string noun, name;  // "scheduler", "mine"
  std::any entry;          // the entry for the Registry of the noun
  std::string version;     // TAKT_VERSION at the library's compilation
  bool is_added = false;   // set when it is added to a Registry
};

/// For static initialisers. Returns false if this thread is not loading a library; then the caller
/// adds the entry to the Registry itself.
bool note_registration(Registration registration);

/// Loads the library unless it is loaded already, and returns its registrations. It is never
/// unloaded. `path` is as for dlopen(3): with a slash it is a file, without one a name to search
/// for. A new library is first checked and loaded in another process, see library_trial.hpp. Throws
/// Error if it cannot be loaded, or was built against another version of Takt (before 1.0: another
/// minor version). Thread safety: from any thread; the result lives as long as the process.
/// Real-time: no.
std::vector<Registration>& load_library(const std::string& path);

}  // namespace takt

#endif  // TAKT_BASE_LIBRARY_HPP_
