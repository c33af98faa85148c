// The index of installed packages: files in share/ament_index/resource_index of each prefix.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <system_error>
#include <vector>

#include "takt/base/regular_file.hpp"

#include "ament_index_cpp/get_package_share_directory.hpp"
#include "ament_index_cpp/get_resource.hpp"

namespace ament_index_cpp {
namespace {

namespace fs = std::filesystem;

// Limit: bytes of a file of the ament index. At it: the file is refused. Seen: the error.
constexpr std::size_t kMostBytes = 1 << 20;

// The prefix of this program comes last: a program in PREFIX/lib/PACKAGE needs no
// AMENT_PREFIX_PATH.
std::vector<fs::path> prefixes() {
  std::vector<fs::path> result;
  if (const char* const path = std::getenv("AMENT_PREFIX_PATH"); path != nullptr) {
    std::istringstream parts(path);
    for (std::string part; std::getline(parts, part, ':');) {
      if (!part.empty()) result.emplace_back(part);
    }
  }
  std::error_code none;
  const fs::path program = fs::read_symlink("/proc/self/exe", none);
  result.push_back(program.parent_path().parent_path().parent_path());
  return result;
}

fs::path entry(const fs::path& prefix, const std::string& type, const std::string& name = {}) {
  return prefix / "share/ament_index/resource_index" / type / name;
}

bool find(const std::string& type, const std::string& name, fs::path& prefix) {
  for (const fs::path& each : prefixes()) {
    if (std::error_code none; fs::is_regular_file(entry(each, type, name), none)) {
      prefix = each;
      return true;
    }
  }
  return false;
}

}  // namespace

PackageNotFoundError::PackageNotFoundError(const std::string& package)
    : std::out_of_range("package '" + package +
                        "' not found, searching: AMENT_PREFIX_PATH and the "
                        "prefix of this program"),
      package_name(package) {
}

std::string get_package_prefix(const std::string& package) {
  fs::path prefix;
  if (!find("packages", package, prefix)) throw PackageNotFoundError(package);
  return prefix.string();
}

std::string get_package_share_directory(const std::string& package) {
  return (fs::path(get_package_prefix(package)) / "share" / package).string();
}

bool get_resource(const std::string& type, const std::string& name, std::string& content,
                  std::string* prefix_path) {
  if (!has_resource(type, name, prefix_path)) return false;
  fs::path prefix;
  find(type, name, prefix);
  content = takt::read_text(entry(prefix, type, name).string(), kMostBytes);
  return true;
}

bool has_resource(const std::string& type, const std::string& name, std::string* prefix_path) {
  fs::path prefix;
  if (!find(type, name, prefix)) return false;
  if (prefix_path != nullptr) *prefix_path = prefix.string();
  return true;
}

std::map<std::string, std::string> get_resources(const std::string& type) {
  std::map<std::string, std::string> result;
  for (const fs::path& prefix : prefixes()) {
    std::error_code none;
    for (const auto& file : fs::directory_iterator(entry(prefix, type), none)) {
      result.emplace(file.path().filename().string(), prefix.string());
    }
  }
  return result;
}

}  // namespace ament_index_cpp
