// What shared libraries register when they are loaded: schedulers, components.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LIBRARY_HPP_
#define TAKT_BASE_LIBRARY_HPP_

#include <any>
#include <string>
#include <string_view>
#include <vector>

namespace takt {

/// One thing that a library registers while its static initialisers run. An exception must not
/// leave those, so it is only noted then, and looked at when the library is loaded.
struct Registration {
  std::string noun, name;  // "scheduler", "mine"
  std::any entry;          // what the noun's Registry takes
  std::string version;     // TAKT_VERSION, as the library's compiler saw it
  bool is_added = false;   // for the code that adds it to a Registry
};

/// For static initialisers. False: this thread loads no library, and the caller adds by itself.
bool note_registration(Registration registration);

/// Loads the library, once for all, and returns what it has registered; it is never unloaded.
/// `path` is as for dlopen(3): with a slash it is a file, without one a name to search for.
/// A library that is new to this process is looked at, and loaded in another process first: see
/// library_trial.hpp. Throws Error when it cannot be loaded, or was built against another Takt: one
/// of another minor version, before 1.0.
/// Thread safety: from any thread; what is returned lives as long as the process.
/// Real-time: no.
std::vector<Registration>& load_library(const std::string& path);

}  // namespace takt

#endif  // TAKT_BASE_LIBRARY_HPP_
