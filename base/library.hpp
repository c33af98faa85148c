// Loads shared libraries that register executors, schedulers, components or message types.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LIBRARY_HPP_
#define TAKT_BASE_LIBRARY_HPP_

#include <any>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/registry.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

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

/// Of libtakt.so, or of the program that has it inside; in the folder `takt` beside it is what it
/// loads and starts. Real-time: no.
std::filesystem::path path_of_takt();
/// Whether that has this code or data. Real-time: no.
bool is_in_takt(const void* address) noexcept;

/// For the functions behind TAKT_REGISTER_…: adds the entry to the registry, or leaves this to
/// load_registered() if this thread is loading a library. Always true. Throws Error when the name
/// is taken.
template <class AnyRegistry>
bool register_in(AnyRegistry& registry, std::string name, typename AnyRegistry::Entry entry,
                 const char* version) {
  if (!note_registration({registry.noun(), name, entry, version})) {
    registry.add(std::move(name), std::move(entry));
  }
  return true;
}

/// Loads the library and returns what it registers under this name; nullptr: that is added already.
/// Throws Error if the library does not register the name or registers it twice, or if it is one of
/// `taken`.
Registration* find_registration(const std::string& noun, const std::string& name,
                                const std::string& library, const std::vector<std::string>& taken);

/// Loads the library and adds to the registry what it registers under this name, unless that is
/// added already. `check` throws Error if the entry is unsound; then nothing is added.
template <class AnyRegistry>
void load_registered(AnyRegistry& registry, const std::string& name, const std::string& library,
                     const std::function<void(const typename AnyRegistry::Entry&)>& check) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  Registration* const found = find_registration(registry.noun(), name, library, registry.names());
  if (found == nullptr) return;
  const auto entry = std::any_cast<typename AnyRegistry::Entry>(found->entry);
  check(entry);
  registry.add(name, entry);
  found->is_added = true;
}

}  // namespace takt

#endif  // TAKT_BASE_LIBRARY_HPP_
