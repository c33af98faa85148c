// SPDX-License-Identifier: Apache-2.0
#include "takt/base/temporary.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

namespace takt {
namespace {

namespace fs = std::filesystem;

TEST(TemporaryFolder, IsItsUsersOnlyAndGoesWithItsFiles) {
  std::string path;
  {
    const TemporaryFolder folder, other;
    path = folder / "file";
    EXPECT_NE(path, other / "file");
    std::ofstream(path) << "content";
    EXPECT_EQ(fs::file_size(path), 7u);
    EXPECT_EQ(fs::status(folder / "").permissions(), fs::perms::owner_all);
  }
  EXPECT_FALSE(fs::exists(fs::path(path).parent_path()));
}

TEST(TemporaryFile, HasNoName) {
  const int fd = temporary_file();
  ASSERT_GE(fd, 0);
  struct stat about {};
  EXPECT_EQ(fstat(fd, &about), 0);
  EXPECT_EQ(about.st_nlink, 0u);
  EXPECT_EQ(about.st_mode & 07777, 0600u);
  EXPECT_EQ(write(fd, "x", 1), 1);
  close(fd);
}

}  // namespace
}  // namespace takt
