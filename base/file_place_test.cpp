// Whom files and folders belong to, and who may change them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/file_place.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr uid_t kStranger = 65534;

/// A tree as `takt ros2 build` makes it, in a folder of its own below /tmp.
class FilePlaceTest : public testing::Test {
 protected:
  FilePlaceTest() {
    std::string folder = "/tmp/takt_XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) ADD_FAILURE() << "no folder " << folder;
    folder_ = folder;
    fs::create_directories(folder_ / "install/lib/demo");
    std::ofstream(folder_ / "install/lib/demo/talker") << "a program";
  }
  ~FilePlaceTest() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ / name; }
  /// Why the program is not taken; empty: it is.
  std::string why_not(const std::string& name = "install/lib/demo/talker") const {
    try {
      check_ours(path(name));
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }
  void expect_refused(const std::string& name, const std::string& why) const {
    EXPECT_THAT(why_not(), testing::AllOf(HasSubstr("'" + path(name) + "'"), HasSubstr(why)))
        << name;
  }

  fs::path folder_;
};

TEST_F(FilePlaceTest, IsOursWhereNobodyElseCanChangeIt) {
  EXPECT_EQ(why_not(), "");
  fs::create_directory_symlink("install", folder_ / "link");
  EXPECT_EQ(why_not("link/../link/lib/./demo/talker"), "");
  EXPECT_THAT(why_not("install/lib/demo/nobody"), HasSubstr("there is no file"));
}

// Not only the folder that was named: any on the way to the file, and the file.
TEST_F(FilePlaceTest, IsNotOursWhereEverybodyCanChangeAPartOfTheWay) {
  for (const char* part :
       {"install", "install/lib", "install/lib/demo", "install/lib/demo/talker"}) {
    const mode_t mode = std::string_view(part).ends_with("talker") ? 0644 : 0755;
    chmod(path(part).c_str(), mode | S_IWOTH);
    expect_refused(part, "every user of this machine can change");
    chmod(path(part).c_str(), mode);
  }
  chmod(folder_.c_str(), 0777);
  EXPECT_THAT(why_not(), HasSubstr("every user of this machine can change"));
}

TEST_F(FilePlaceTest, IsNotOursWhereAPartOfTheWayIsAnothers) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give files away";
  for (const char* part :
       {"install", "install/lib", "install/lib/demo", "install/lib/demo/talker"}) {
    ASSERT_EQ(chown(path(part).c_str(), kStranger, 0), 0);
    expect_refused(part, "belongs to user 65534");
    ASSERT_EQ(chown(path(part).c_str(), 0, 0), 0);
    ASSERT_EQ(chown(path(part).c_str(), 0, kStranger), 0);
    const mode_t mode = std::string_view(part).ends_with("talker") ? 0644 : 0755;
    chmod(path(part).c_str(), mode | S_IWGRP);
    expect_refused(part, "group 65534 can change");
    chmod(path(part).c_str(), mode);
    ASSERT_EQ(chown(path(part).c_str(), 0, 0), 0);
  }
  // A link of another's, to what is ours.
  fs::create_directory_symlink("install", folder_ / "link");
  ASSERT_EQ(lchown(path("link").c_str(), kStranger, 0), 0);
  EXPECT_THAT(why_not("link/lib/demo/talker"), HasSubstr("'" + path("link") + "' belongs to user"));
}

TEST_F(FilePlaceTest, BeneathAFolderHoldsWhatHoldsForTheFolder) {
  const auto why = [&] {
    try {
      check_beneath(path("install"), path("install/lib/demo/talker"));
      return std::string();
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(why(), "");
  for (const char* part : {"install/lib", "install/lib/demo/talker"}) {
    chmod(path(part).c_str(), 0777);
    EXPECT_THAT(why(), HasSubstr("can change the"));
    EXPECT_THAT(why(), HasSubstr(path(part)));
    chmod(path(part).c_str(), 0755);
  }
  const FilePlace place(path("install"), "lib/demo/talker");
  const int file = place.open(O_RDONLY);
  EXPECT_GE(file, 0);
  close(file);
  chmod(path("install/lib").c_str(), 0777);
  EXPECT_THROW(place.open(O_RDONLY), Error);
}

}  // namespace
}  // namespace takt
