// Bundles as archives: a library of its own, which only those load that pack or unpack one. What
// libarchive links takes 1.4 MB of memory in each process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_ARCHIVE_HPP_
#define TAKT_TOOLS_TAKT_ARCHIVE_HPP_

#include <cstddef>
#include <string>
#include <vector>

#include "takt/base/error.hpp"

#include "bundle/bundle.hpp"

namespace takt::tools {

// Limit: bytes of a bundle, and of what is in it. At it: neither made nor opened. Seen: the error.
inline constexpr std::size_t kMostBytes = std::size_t{256} << 20;
// Limit: files in a bundle. At it: it is not opened. Seen: the error.
inline constexpr std::size_t kMostFiles = 1000;

[[noreturn]] inline void refuse_bundle(const std::string& path, const std::string& why) {
  throw Error(why, "ask its maker for another one; nothing was written", path);
}

/// What the library has, by the name `kArchives`. `path` is for messages.
struct Archives {
  /// The same files are the same bytes: nothing of the machine is in them. Throws
  /// std::runtime_error.
  std::string (*pack)(const std::vector<BundledFile>& files, const std::string& path);
  /// Of a stranger: their names are not looked at. Throws Error if these are no files, or beyond
  /// the limits.
  std::vector<BundledFile> (*unpack)(const std::string& bytes, const std::string& path);
};
inline constexpr const char* kArchives = "takt_archives";

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_ARCHIVE_HPP_
