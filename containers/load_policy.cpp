// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/load_policy.hpp"

#include <algorithm>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/containers/component.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;

bool is_in_or_below(const fs::path& library, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), library.begin(), library.end()).first ==
         folder.end();
}

bool is_in_index(const std::string& library) {
  const std::vector<IndexedComponent> index = component_index();
  return std::any_of(index.begin(), index.end(), [&](const IndexedComponent& indexed) {
    return real_library(indexed.library) == library;
  });
}

}  // namespace

void LoadPolicy::check() const {
  if (kind != Kind::off) return;
  throw Error("this container loads no components on request",
              "write `load: index` for it in its file, or use `takt run --name NAME --load index`");
}

std::string LoadPolicy::permitted(const std::string& library) const {
  check();
  if (kind == Kind::any) return library;
  const std::string path = real_library(library);
  const bool is_named = std::find(libraries.begin(), libraries.end(), path) != libraries.end();
  const auto is_in = [&](const std::string& folder) { return is_in_or_below(path, folder); };
  if (path.empty() ||
      !(is_named || std::any_of(folders.begin(), folders.end(), is_in) || is_in_index(path))) {
    const std::string folder = fs::path(path).parent_path();
    throw Error(
        fmt::format("library '{}' may not be loaded: neither the component index nor the "
                    "container's file names it",
                    path.empty() ? library : path),
        fmt::format("allow its folder by `load: {{libraries: [{0}]}}` under the container in its "
                    "file, or by `takt run --name NAME --load {0}`",
                    folder.empty() ? "FOLDER" : folder));
  }
  // The dynamic linker would expand `$LIB` in a path, and so load another file than the checked
  // one.
  std::error_code none;
  if (path.find('/') == std::string::npos || fs::is_regular_file(path, none)) return path;
  throw Error(fmt::format("there is no library '{}'", path), "name a shared library");
}

std::string real_library(const std::string& library) {
  if (library.find('/') == std::string::npos) return library;
  std::error_code error;
  const fs::path path = fs::weakly_canonical(library, error);
  return error ? std::string() : path.string();
}

std::string real_folder(const std::string& folder) {
  std::error_code error;
  const fs::path path = fs::canonical(folder, error);
  if (!error && fs::is_directory(path, error)) return path;
  throw Error(fmt::format("there is no folder '{}'", folder), "name one that has libraries");
}

LoadPolicy parse_load_policy(const std::vector<std::string>& words) {
  static const std::map<std::string, LoadPolicy::Kind> kinds{{"off", LoadPolicy::Kind::off},
                                                             {"index", LoadPolicy::Kind::index},
                                                             {"any", LoadPolicy::Kind::any}};
  LoadPolicy policy;
  for (const std::string& word : words) {
    const auto kind = kinds.find(word);
    if (kind == kinds.end()) {
      policy.folders.push_back(real_folder(word));
    } else if (words.size() > 1) {
      throw Error(fmt::format("'{}' cannot be combined with other values", word),
                  "give `off`, `index` or `any` alone, or only folders, which extend the index");
    } else {
      policy.kind = kind->second;
    }
  }
  return policy;
}

}  // namespace takt
