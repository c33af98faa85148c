// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/load_policy.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>

#include <fmt/format.h>
#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/file_place.hpp"
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
  constexpr const char* kAllow =
      "write `load: index` for it in its file, or use `takt run --name NAME --load index`";
  if (kind == Kind::off) throw Error("this container loads no components on request", kAllow);
  if (privileges.empty()) return;
  throw Error(fmt::format("this container {}, and its owner does not say that it may load "
                          "components on request",
                          privileges),
              kAllow);
}

std::string LoadPolicy::permitted(const std::string& library) const {
  check();
  if (kind == Kind::any) return library;
  const std::string path = real_library(library);
  const bool is_named = std::find(libraries.begin(), libraries.end(), path) != libraries.end();
  const auto in = std::find_if(folders.begin(), folders.end(), [&](const std::string& folder) {
    return is_in_or_below(path, folder);
  });
  const bool is_trusted = is_named || is_in_index(path);
  if (path.empty() || !(is_trusted || in != folders.end())) {
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
  if (path.find('/') == std::string::npos) return path;
  if (fs::is_regular_file(path, none)) {
    if (!is_trusted) check_beneath(*in, path);
    return path;
  }
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
  if (error || !fs::is_directory(path, error)) {
    throw Error(fmt::format("there is no folder '{}'", folder), "name one that has libraries");
  }
  check_folder(path);
  return path;
}

LoadPolicy parse_load_policy(const std::vector<std::string>& words, const std::string& recordings) {
  static const std::map<std::string, LoadPolicy::Kind> kinds{{"off", LoadPolicy::Kind::off},
                                                             {"index", LoadPolicy::Kind::index},
                                                             {"any", LoadPolicy::Kind::any}};
  LoadPolicy policy;
  policy.is_given = !words.empty() || !recordings.empty();
  if (!recordings.empty()) {
    check_own_folder(recordings);
    policy.recordings = fs::canonical(recordings);
  }
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

std::string privileges() {
  uid_t real = 0, effective = 0, saved = 0;
  getresuid(&real, &effective, &saved);
  if (real == 0 || effective == 0 || saved == 0) return "runs as root";
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> data{};
  if (syscall(SYS_capget, &header, data.data()) != 0) return "";
  const std::uint64_t permitted = data[0].permitted | std::uint64_t{data[1].permitted} << 32;
  constexpr std::uint64_t kOfRealTime = std::uint64_t{1} << CAP_SYS_NICE | std::uint64_t{1}
                                                                               << CAP_IPC_LOCK;
  if ((permitted & ~kOfRealTime) == 0) return "";
  return fmt::format("has capabilities other than CAP_SYS_NICE and CAP_IPC_LOCK ({:016x})",
                     permitted);
}

}  // namespace takt
