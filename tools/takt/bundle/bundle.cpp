// SPDX-License-Identifier: Apache-2.0
#include "bundle/bundle.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <stdexcept>
#include <string_view>

#include <dlfcn.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <openssl/evp.h>
#include <sys/stat.h>

#include "takt/base/error.hpp"
#include "takt/base/library.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/base/version.hpp"
#include "takt/measuring/json_text.hpp"

#include "bundle/archive.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kLongestName = 200;
constexpr std::size_t kLongestVersion = 40;  // of it more is not shown

const Archives& archives() {
  const fs::path library = path_of_takt().parent_path() / "takt" / "libtakt_archive.so";
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = handle != nullptr ? dlsym(handle, kArchives) : nullptr;
  if (found == nullptr) {
    throw Error(fmt::format("bundles cannot be packed or unpacked: {}", dlerror()),
                "install Takt whole, and libarchive");
  }
  return *static_cast<const Archives*>(found);
}

std::string sha256(std::string_view content) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_Digest(content.data(), content.size(), digest, &length, EVP_sha256(), nullptr) != 1)
    throw std::runtime_error("OpenSSL has no SHA-256");
  std::string text;
  for (unsigned int i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

json about(const BundledFile& file) {
  return {{"bytes", file.content.size()}, {"sha256", sha256(file.content)}};
}

/// Relative, without "..", and of signs that a terminal and a shell leave alone.
bool is_plain(std::string_view path) {
  if (path.empty() || path.size() > kLongestName || printable(path) != path) return false;
  if (path.find_first_of("\\\n\t") != path.npos) return false;
  while (true) {
    const std::string_view part = path.substr(0, path.find('/'));
    if (part.empty() || part == "." || part == "..") return false;
    if (part.size() == path.size()) return true;
    path.remove_prefix(part.size() + 1);
  }
}

// All lie in one folder, which is theirs alone.
void leave_folder(std::vector<BundledFile>& files, const std::string& path) {
  const std::string folder = files.empty() ? "" : files[0].path.substr(0, files[0].path.find('/'));
  std::set<std::string> names;
  for (BundledFile& file : files) {
    if (!is_plain(file.path))
      refuse_bundle(path,
                    fmt::format("'{}' is no name of a file in a bundle", printable(file.path)));
    if (!file.path.starts_with(folder + "/"))
      refuse_bundle(path, fmt::format("'{}' is outside of its folder '{}'", file.path, folder));
    file.path.erase(0, folder.size() + 1);
    if (!names.insert(file.path).second)
      refuse_bundle(path, fmt::format("it has '{}' twice", file.path));
  }
  for (const std::string& name : names) {
    for (std::size_t end = name.rfind('/'); end != name.npos; end = name.rfind('/', end - 1)) {
      if (end == 0) break;
      if (names.contains(name.substr(0, end)))
        refuse_bundle(path, fmt::format("'{}' is a file and a folder", name.substr(0, end)));
    }
  }
}

void check_manifest(const std::vector<BundledFile>& files, const std::string& path) {
  json wanted, found = json::object();
  bool has_script = false;
  for (const BundledFile& file : files) {
    has_script = has_script || file.path == kRunScript;
    if (file.path == kManifest) {
      wanted = rt::json_or_null(file.content);
    } else {
      found[file.path] = about(file);
    }
  }
  if (!wanted.is_object() || !has_script)
    refuse_bundle(path, fmt::format("it lacks '{}' or '{}'", kManifest, kRunScript));
  if (wanted.value("files", json()) == found) return;
  refuse_bundle(path, fmt::format("its files are not those that its {} lists", kManifest));
}

}  // namespace

void check_bundled_name(const std::string& path) {
  const bool is_ours = path == kManifest || path == kRunScript || path == kResults;
  if (is_plain(path) && path[0] != '-' && !is_ours) return;
  throw Error(fmt::format("'{}' is no name for a file in a bundle{}", printable(path),
                          is_ours ? ", which has one of its own" : ""),
              "rename it");
}

void write_bundle(const std::string& path, std::vector<BundledFile> files) {
  json manifest{{"takt", {{"version", TAKT_VERSION}}}, {"files", json::object()}};
  std::size_t bytes = 0;
  for (const BundledFile& file : files) {
    manifest["files"][file.path] = about(file);
    bytes += file.content.size();
  }
  if (bytes > kMostBytes || files.size() >= kMostFiles) {
    throw Error(
        fmt::format("a bundle has at most {} MiB and {} files", kMostBytes >> 20, kMostFiles),
        "bundle fewer files, or make fewer repeats", path);
  }
  files.push_back({kManifest, rt::json_text(manifest, 1) + "\n"});
  const std::string folder = folder_of_bundle(path) + "/";
  for (BundledFile& file : files) file.path.insert(0, folder);
  const std::string compressed = archives().pack(files, path);
  OutputFile file(path, OutputFile::Whose::unmarked);
  file.write(compressed);
  file.complete();
}

std::vector<BundledFile> read_bundle(const std::string& path) {
  std::vector<BundledFile> files = archives().unpack(read_text(path, kMostBytes), path);
  leave_folder(files, path);
  check_manifest(files, path);
  return files;
}

std::string version_of(const std::vector<BundledFile>& files) {
  for (const BundledFile& file : files) {
    if (file.path != kManifest) continue;
    const json made = rt::json_or_null(file.content).value("takt", json());
    const json version = made.is_object() ? made.value("version", json()) : json();
    return version.is_string() ? version.get<std::string>().substr(0, kLongestVersion) : "";
  }
  return "";
}

std::string folder_of_bundle(const std::string& path) {
  std::string name = fs::path(path).filename();
  const std::size_t end = name.find(".tar");
  return end == 0 || end == name.npos ? name + ".files" : name.substr(0, end);
}

void extract(const std::vector<BundledFile>& files, const std::string& folder) {
  if (mkdir(folder.c_str(), 0755) != 0) {
    const int error = errno;
    throw Error("the folder cannot be made: " + errno_message(error),
                "name one that is not there, with --into", folder);
  }
  for (const BundledFile& file : files) {
    fs::create_directories((fs::path(folder) / file.path).parent_path());
    OutputFile to(FilePlace(folder, file.path), OutputFile::Whose::person);
    to.write(file.content);
    to.complete();
    fs::permissions(fs::path(folder) / file.path, fs::perms(file.path == kRunScript ? 0755 : 0644));
  }
}

}  // namespace takt::tools
