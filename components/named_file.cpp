// SPDX-License-Identifier: Apache-2.0
#include "takt/components/named_file.hpp"

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {

FilePlace named_file(const NodeOptions& options, const std::string& path) {
  if (options.is_only_constructed) return FilePlace(path).as_checked_only();
  if (!options.guest) return path;
  const std::string& folder = options.guest->recordings;
  if (folder.empty()) {
    throw Error(fmt::format("file '{}': what a request loads may use no files here", path),
                "name a folder for them by `load: {recordings: DIR}` under the container in its "
                "file, or by `takt run --name NAME --recordings DIR`");
  }
  if (path.starts_with('/')) {
    throw Error(fmt::format("file '{}': what a request loads may use files in the container's "
                            "folder for recordings only",
                            path),
                "give a path that begins there, such as drive.mcap");
  }
  return {folder, path};
}

}  // namespace takt
