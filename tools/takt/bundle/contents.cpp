// What a bundle has in it: configuration files, libraries, and the script that runs them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <link.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/containers/configuration/system_description.hpp"

#include "bundle/bundle.hpp"
#include "model/extraction.hpp"
#include "run/feed.hpp"
#include "shell_word.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;

// Limit: bytes of a file that a bundle takes. At it: it is not made. Seen: the error.
constexpr std::size_t kMostOfFile = std::size_t{64} << 20;

/// Files by their path in the bundle, with where they come from.
class Contents {
 public:
  void add(const std::string& path, const std::string& from) {
    check_bundled_name(path);
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

[[noreturn]] void refuse_file(const fs::path& named, const std::string& file) {
  throw Error(
      fmt::format("'{}' is named by a path that leads out of the file's folder", named.string()),
      "put it into that folder", file);
}

/// Else in `lib`, where the dynamic linker looks.
std::string place_of(const fs::path& library, const std::string& file, const std::string& text) {
  if (const std::string beside = place_beside(file, library); !beside.empty()) return beside;
  const std::string name = library.filename();
  if (text.find("/" + name) != text.npos) refuse_file(library, file);
  return "lib/" + name;
}

void add_others(const SystemDescription& system, const std::string& file, Contents& contents) {
  std::vector<std::string> others = system.parameter_files;
  if (!system.model.empty()) others.push_back(system.model);
  for (const std::string& named : others) {
    const std::string path = place_beside(file, named);
    if (path.empty()) refuse_file(named, file);
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

/// Throws Error unless `takt check` takes the file with what is in the folder: a link, a path of
/// this machine, anything else that would be missing elsewhere.
void check_elsewhere(const std::string& folder, const std::string& file) {
  const std::string takt = fs::read_symlink("/proc/self/exe");
  const std::string search = fmt::format("TAKT_COMPONENT_PATH={0} LD_LIBRARY_PATH={0}/lib", folder);
  const std::string command = fmt::format("cd {} && {} {} check {} >&2", shell_word(folder), search,
                                          shell_word(takt), shell_word("./" + file));
  if (feed({"/bin/sh", "-c", command}, "") == 0) return;
  throw Error("in the bundle alone, the file is not valid; see above",
              "name all that it needs by paths within its folder, without links", file);
}

}  // namespace

std::string bundled(const std::string& file) {
  return fs::path(file).filename();
}

std::vector<BundledFile> files_of_systems(const std::vector<std::string>& systems,
                                          const std::string& model) {
  Contents contents;
  if (!model.empty()) contents.add(bundled(model), model);
  std::set<std::string> names;
  for (const std::string& file : systems) {
    if (!names.insert(bundled(file)).second) {
      throw Error(fmt::format("two files would have the name '{}' in the bundle", bundled(file)),
                  "rename one of them, or name it once", file);
    }
    contents.add(bundled(file), file);
    const SystemDescription system = read_system(file);
    add_libraries(system, file, contents);
    add_others(system, file, contents);
  }
  std::vector<BundledFile> files = contents.read();
  const TemporaryFolder folder;
  extract(files, folder / "bundle");
  for (const std::string& name : names) check_elsewhere(folder / "bundle", name);
  return files;
}

std::string run_script(const std::vector<std::string>& words) {
  std::vector<std::string> shown;
  std::transform(words.begin(), words.end(), std::back_inserter(shown), shell_word);
  return fmt::format(R"sh(#!/bin/sh
# Written by takt: repeats the comparison of this folder, and compares it with what was measured.
cd "$(dirname "$0")" || exit
TAKT_COMPONENT_PATH=$PWD${{TAKT_COMPONENT_PATH:+:$TAKT_COMPONENT_PATH}} \
  LD_LIBRARY_PATH=$PWD/lib${{LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}} exec "${{TAKT:-takt}}" {}
)sh",
                     fmt::join(shown, " "));
}

}  // namespace takt::tools
