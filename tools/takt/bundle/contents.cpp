// What a bundle has in it: configuration files, libraries, and the script that runs them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <link.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/containers/configuration/system_description.hpp"

#include "bundle/bundle.hpp"
#include "model/extraction.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;

// Limit: bytes of a file that a bundle takes. At it: it is not made. Seen: the error.
constexpr std::size_t kMostOfFile = std::size_t{64} << 20;

/// Files by their path in the bundle, with where they come from.
class Contents {
 public:
  void add(const std::string& path, const std::string& from) {
    const auto [there, is_new] = files_.try_emplace(path, from);
    std::error_code none;
    if (is_new || fs::equivalent(there->second, from, none)) return;
    throw Error(fmt::format("'{}' and '{}' would have one name in the bundle", there->second, from),
                "rename one of them");
  }
  void index(const std::string& type, const std::string& library) {
    index_ += fmt::format("{};{}\n", type, library);
  }
  std::vector<BundledFile> read() const {
    std::vector<BundledFile> result;
    for (const auto& [path, from] : files_) result.push_back({path, read_text(from, kMostOfFile)});
    if (!index_.empty()) result.push_back({"share/takt/components/bundle", index_});
    return result;
  }

 private:
  std::map<std::string, std::string> files_;
  std::string index_;
};

/// Of what reading the file has loaded, the path. Empty: it is not loaded.
fs::path loaded_library(const std::string& name) {
  if (name.find('/') != name.npos) return name;
  void* const handle = dlopen(name.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  if (handle == nullptr) return {};
  const link_map* map = nullptr;
  const bool is_known = dlinfo(handle, RTLD_DI_LINKMAP, &map) == 0;
  const fs::path path = is_known ? fs::canonical(map->l_name) : fs::path();
  dlclose(handle);
  return path;
}

/// In the folder of the file that names it: a relative path leads there. Empty: it is elsewhere.
std::string place_beside(const std::string& file, const fs::path& named) {
  const fs::path beside =
      fs::canonical(named).lexically_relative(fs::canonical(file).parent_path());
  return beside.empty() || *beside.begin() == ".." ? fs::path() : beside;
}

[[noreturn]] void refuse(const fs::path& named, const std::string& file) {
  throw Error(
      fmt::format("'{}' is named by a path that leads out of the file's folder", named.string()),
      "put it into that folder", file);
}

/// Else in `lib`, where the dynamic linker looks.
std::string place_of(const fs::path& library, const std::string& file, const std::string& text) {
  if (const std::string beside = place_beside(file, library); !beside.empty()) return beside;
  const std::string name = library.filename();
  if (text.find("/" + name) != text.npos) refuse(library, file);
  return "lib/" + name;
}

void add_parameters(const SystemDescription& system, const std::string& file, Contents& contents) {
  for (const std::string& named : system.parameter_files) {
    const std::string path = place_beside(file, named);
    if (path.empty()) refuse(named, file);
    contents.add(path, named);
  }
}

void add_libraries(const SystemDescription& system, const std::string& file, Contents& contents) {
  const std::string text = read_text(file, kMostOfFile);
  for (const std::string& named : system.libraries) {
    if (const fs::path library = loaded_library(named); !library.empty())
      contents.add(place_of(library, file, text), library);
  }
  for (const ComponentDescription& component : system.components) {
    if (!component.library.empty()) continue;
    const std::string library = library_of(component);
    if (library.empty()) continue;
    const std::string path = "lib/" + fs::path(library).filename().string();
    contents.add(path, library);
    contents.index(component.type, path);
  }
}

std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./,";
  if (!word.empty() && word.find_first_not_of(kPlain) == word.npos) return word;
  std::string text = "'";
  for (const char letter : word)
    text += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  return text + "'";
}

}  // namespace

std::string bundled(const std::string& file) {
  return fs::path(file).filename();
}

std::vector<BundledFile> files_of_systems(const std::vector<std::string>& systems,
                                          const std::string& model) {
  Contents contents;
  if (!model.empty()) contents.add(bundled(model), model);
  for (const std::string& file : systems) {
    contents.add(bundled(file), file);
    const SystemDescription system = read_system(file);
    add_libraries(system, file, contents);
    add_parameters(system, file, contents);
  }
  return contents.read();
}

std::string run_script(const std::vector<std::string>& words) {
  std::vector<std::string> shown;
  std::transform(words.begin(), words.end(), std::back_inserter(shown), quoted);
  return fmt::format(R"sh(#!/bin/sh
# Written by takt: repeats the comparison of this folder, and compares it with what was measured.
cd "$(dirname "$0")" || exit
TAKT_COMPONENT_PATH=$PWD LD_LIBRARY_PATH=$PWD/lib exec "${{TAKT:-takt}}" {} "$@"
)sh",
                     fmt::join(shown, " "));
}

}  // namespace takt::tools
