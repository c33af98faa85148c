// SPDX-License-Identifier: Apache-2.0
#include "takt/base/library.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <map>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/library_trial.hpp"
#include "takt/base/version.hpp"

namespace takt {
namespace {

using Registrations = std::vector<Registration>;

// Registrations of the library that this thread is loading; nullptr: of the program, or of
// libraries loaded with it.
thread_local constinit Registrations* of_library = nullptr;

// nullptr: the library cannot be loaded, and dlerror() has the reason.
void* open_library(const char* path, Registrations& noted) {
  struct Noting {
    explicit Noting(Registrations& to) { of_library = &to; }
    ~Noting() { of_library = nullptr; }
  };
  const Noting noting(noted);
  return dlopen(path, RTLD_NOW | RTLD_LOCAL);
}

// Far longer than any library needs, even on a busy machine.
constexpr auto kTrialLimit = std::chrono::seconds(30);

// Throws Error unless this process may load the library.
void check_library(const std::string& path) {
  try {
    if (path.find('/') != std::string::npos) check_library_file(path);
    try_library(path, kTrialLimit);
  } catch (const Error& error) {
    throw Error(fmt::format("library '{}' cannot be loaded: {}", path, error.what()));
  }
}

// "0.1" of "0.1.0".
std::string_view minor_version(std::string_view version) {
  return version.substr(0, version.rfind('.'));
}

}  // namespace

std::filesystem::path path_of_takt() {
  Dl_info own{};
  dladdr(reinterpret_cast<const void*>(&path_of_takt), &own);
  std::error_code none;
  return std::filesystem::canonical(own.dli_fname != nullptr ? own.dli_fname : "", none);
}

bool is_in_takt(const void* address) noexcept {
  Dl_info own{}, other{};
  return dladdr(reinterpret_cast<const void*>(&path_of_takt), &own) != 0 &&
         dladdr(address, &other) != 0 && own.dli_fbase == other.dli_fbase;
}

// Called by the program takt_try_library. It ignores errors of dlopen: load_library gets the same
// ones.
extern "C" TAKT_INTERNAL void takt_try_library(const char* path) {
  Registrations noted;
  open_library(path, noted);
}

bool note_registration(Registration registration) {
  if (of_library == nullptr) return false;
  of_library->push_back(std::move(registration));
  return true;
}

std::vector<Registration>& load_library(const std::string& path) {
  static std::mutex mutex;
  // By handle: a library has one handle whatever its path, and its initialisers run once.
  static std::map<void*, Registrations> libraries;
  static std::set<std::string> loaded;  // paths that were loaded
  const std::lock_guard lock(mutex);
  if (!loaded.contains(path)) check_library(path);
  Registrations noted;
  void* const handle = open_library(path.c_str(), noted);
  if (handle == nullptr) {
    throw Error(fmt::format("library '{}' cannot be loaded: {}", path, dlerror()),
                "give the path of a shared library that fits this program");
  }
  loaded.insert(path);
  Registrations& registrations = libraries.try_emplace(handle, std::move(noted)).first->second;
  for (const Registration& registration : registrations) {
    if (minor_version(registration.version) == minor_version(TAKT_VERSION)) continue;
    throw Error(fmt::format("library '{}' was built against Takt {}, and this is Takt {}", path,
                            registration.version, TAKT_VERSION),
                "build it again, against this one");
  }
  return registrations;
}

Registration* find_registration(const std::string& noun, const std::string& name,
                                const std::string& library, const std::vector<std::string>& taken) {
  std::vector<std::string> names;
  Registration* found = nullptr;
  for (Registration& registration : load_library(library)) {
    if (registration.noun != noun) continue;
    names.push_back(registration.name);
    if (registration.name == name) found = &registration;
  }
  if (found == nullptr) {
    std::string macro = "TAKT_REGISTER_" + noun;
    std::transform(macro.begin(), macro.end(), macro.begin(), ::toupper);
    throw Error(
        fmt::format("library '{}' registers no {} '{}'", library, noun, name),
        names.empty() ? fmt::format("say {}(\"{}\", …) in it", macro, name) : suggest(name, names));
  }
  if (std::count(names.begin(), names.end(), name) > 1) {
    throw Error(fmt::format("library '{}' registers {} '{}' twice", library, noun, name),
                "give each its own name");
  }
  if (found->is_added) return nullptr;
  if (std::find(taken.begin(), taken.end(), name) != taken.end()) {
    throw Error(fmt::format("the name '{}' is taken by another {}", name, noun),
                fmt::format("register it under another name than {}", fmt::join(taken, ", ")));
  }
  return found;
}

}  // namespace takt
