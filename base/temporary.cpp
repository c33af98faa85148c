// SPDX-License-Identifier: Apache-2.0
#include "takt/base/temporary.hpp"

#include <cerrno>
#include <cstdlib>
#include <filesystem>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

constexpr const char* kName = "/takt_XXXXXX";

std::string parent() {
  std::error_code none;
  const std::filesystem::path path = std::filesystem::temp_directory_path(none);
  return none ? "/tmp" : path.string();
}

}  // namespace

TemporaryFolder::TemporaryFolder() : path_(parent() + kName) {
  if (mkdtemp(path_.data()) != nullptr) return;
  throw Error(fmt::format("no folder can be made in {}: {}", parent(), errno_message(errno)),
              "name a place for temporary files in the variable TMPDIR");
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

int temporary_file() {
  const std::string folder = parent();
  const int unnamed = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (unnamed >= 0) return unnamed;
  std::string path = folder + kName;  // file systems may lack O_TMPFILE
  const int named = mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) unlink(path.c_str());
  return named;
}

}  // namespace takt
