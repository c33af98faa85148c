// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <sstream>

#include <dlfcn.h>
#include <fmt/format.h>

#include "takt/base/library.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/messages/message_types.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNoun = "component";
// The folder of an index, and the folder that its library paths are relative to.
struct IndexFolder {
  fs::path folder, prefix;
};

void add_prefixes(const char* variable, const char* folder, std::vector<IndexFolder>& result) {
  const char* const path = std::getenv(variable);
  if (path == nullptr) return;
  std::istringstream parts(path);
  for (std::string part; std::getline(parts, part, ':');) {
    if (!part.empty()) result.push_back({fs::path(part) / folder, part});
  }
}

// Only for TAKT_COMPONENT_PATH: most prefixes in ROS 2's AMENT_PREFIX_PATH have no components.
void warn_of_missing(const std::vector<IndexFolder>& folders) {
  static std::atomic<bool> has_warned{false};
  for (const IndexFolder& index : folders) {
    std::error_code none;
    if (fs::is_directory(index.folder, none) || has_warned.exchange(true)) continue;
    log(LogLevel::warn, "TAKT_COMPONENT_PATH: there is no folder '{}'",
        printable(index.folder.string()));
  }
}

// First the prefixes in the environment, then the folders above libtakt.so (which of them is the
// prefix depends on the name of the library folder), last ROS 2's prefixes.
std::vector<IndexFolder> index_folders() {
  constexpr const char* kOwn = "share/takt/components";
  std::vector<IndexFolder> result;
  add_prefixes("TAKT_COMPONENT_PATH", kOwn, result);
  warn_of_missing(result);
  Dl_info own{};
  if (dladdr(reinterpret_cast<const void*>(&components), &own) != 0 && own.dli_fname != nullptr) {
    std::error_code ignored;
    fs::path prefix = fs::canonical(own.dli_fname, ignored).parent_path();
    for (int i = 0; i < 2 && prefix.has_relative_path(); ++i) {
      prefix = prefix.parent_path();
      result.push_back({prefix / kOwn, prefix});
    }
  }
  add_prefixes("AMENT_PREFIX_PATH", "share/ament_index/resource_index/rclcpp_components", result);
  return result;
}

// Limit: bytes of a file of the component index. At it: the file is refused. Seen: the error.
constexpr std::size_t kMostIndexBytes = 1 << 20;

void read_index(const fs::path& file, const fs::path& prefix,
                std::vector<IndexedComponent>& index) {
  std::istringstream lines(read_text(file.string(), kMostIndexBytes));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.empty()) continue;
    const std::size_t end = line.find(';');
    if (end == std::string::npos || end == 0 || end + 1 == line.size()) {
      throw Error(fmt::format("{}:{}: '{}' is not an entry of the component index", file.string(),
                              number, line),
                  "write 'namespace::Class;lib/libname.so', or delete the file");
    }
    const std::string name = line.substr(0, end);
    const auto is_namesake = [&](const auto& known) { return known.name == name; };
    if (std::any_of(index.begin(), index.end(), is_namesake)) continue;
    index.push_back({name, prefix / line.substr(end + 1)});
  }
}

bool is_registered(const std::string& name) {
  const std::vector<std::string> names = components().names();
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Registers all classes and message types of a library, or none.
void add_all(std::vector<Registration>& registrations, const std::string& name,
             const std::string& library) {
  std::vector<std::string> names;
  std::vector<Registration*> fresh;
  for (Registration& registration : registrations) {
    if (registration.noun != kNoun) continue;
    names.push_back(registration.name);
    if (!registration.is_added) fresh.push_back(&registration);
  }
  if (names.empty()) {
    throw Error(fmt::format("library '{}' registers no component", library),
                fmt::format("add TAKT_REGISTER_COMPONENT({}) to its code", name));
  }
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    throw Error(fmt::format("library '{}' registers no component '{}'", library, name),
                suggest(name, names));
  }
  for (const Registration* registration : fresh) {
    if (is_registered(registration->name) ||
        std::count(names.begin(), names.end(), registration->name) > 1) {
      throw Error(fmt::format("library '{}' registers component '{}', and there is one already",
                              library, registration->name),
                  "give each class its own name, or load only one of the two libraries");
    }
  }
  message_types().add(registrations, library);
  for (Registration* registration : fresh) {
    components().add(registration->name,
                     std::any_cast<ComponentRegistry::Entry>(registration->entry));
    registration->is_added = true;
  }
}

}  // namespace

template class Registry<Component, NoTraits, const NodeOptions&>;

ComponentRegistry& components() {
  static ComponentRegistry registry(kNoun);
  return registry;
}

std::vector<std::string> component_names() {
  std::vector<std::string> names = components().names();
  std::erase_if(names, [](const auto& name) { return name.starts_with("takt::tools::"); });
  return names;
}

std::vector<IndexedComponent> component_index() {
  std::vector<IndexedComponent> index;
  for (const auto& [folder, prefix] : index_folders()) {
    std::vector<fs::path> files;
    std::error_code none;
    for (const auto& file : fs::directory_iterator(folder, none)) {
      if (file.is_regular_file(none)) files.push_back(file.path());
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) read_index(file, prefix, index);
  }
  return index;
}

void find_component(const std::string& name, const std::string& library) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (!library.empty()) return add_all(load_library(library), name, library);
  if (is_registered(name)) return;
  std::vector<std::string> names = component_names();
  for (const IndexedComponent& indexed : component_index()) {
    if (indexed.name == name) {
      return add_all(load_library(indexed.library), name, indexed.library);
    }
    names.push_back(indexed.name);
  }
  throw Error(
      fmt::format("no component is called '{}'", name),
      suggest(name, names) +
          "; others are in libraries: name it with 'library', or the prefix of its index in "
          "TAKT_COMPONENT_PATH");
}

bool register_component(std::string name, std::string description, ComponentRegistry::Factory make,
                        const char* version) {
  return register_in(components(), std::move(name), {std::move(description), std::move(make)},
                     version);
}

}  // namespace takt
