// SPDX-License-Identifier: Apache-2.0
#include "takt/base/library.hpp"

#include <map>
#include <mutex>
#include <utility>

#include <dlfcn.h>
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/version.hpp"

namespace takt {
namespace {

using Registrations = std::vector<Registration>;

// Of the library that this thread is loading; nullptr: of the program, or of what loads with it.
thread_local constinit Registrations* of_library = nullptr;

// "0.1" of "0.1.0".
std::string_view minor_version(std::string_view version) {
  return version.substr(0, version.rfind('.'));
}

}  // namespace

bool note_registration(Registration registration) {
  if (of_library == nullptr) return false;
  of_library->push_back(std::move(registration));
  return true;
}

std::vector<Registration>& load_library(const std::string& path) {
  static std::mutex mutex;
  // By handle: however it is named, a library has one, and its initialisers run once.
  static std::map<void*, Registrations> libraries;
  const std::lock_guard lock(mutex);
  Registrations noted;
  of_library = &noted;
  void* const handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  of_library = nullptr;
  if (handle == nullptr) {
    throw Error(fmt::format("library '{}' cannot be loaded: {}", path, dlerror()),
                "give the path of a shared library that fits this program");
  }
  Registrations& registrations = libraries.try_emplace(handle, std::move(noted)).first->second;
  for (const Registration& registration : registrations) {
    if (minor_version(registration.version) == minor_version(TAKT_VERSION)) continue;
    throw Error(fmt::format("library '{}' was built against Takt {}, and this is Takt {}", path,
                            registration.version, TAKT_VERSION),
                "build it again, against this one");
  }
  return registrations;
}

}  // namespace takt
