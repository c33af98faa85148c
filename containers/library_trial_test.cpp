// A library that would end or hang the process that loads it is refused. It was loaded at once: a
// container, or `takt check`, ended by SIGBUS or std::terminate, or waited for a FIFO for ever.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/library_trial.hpp"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "takt/containers/component.hpp"

namespace takt::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;

class LibraryTrial : public testing::Test {
 protected:
  LibraryTrial() {
    std::string folder = testing::TempDir() + "takt_XXXXXX";
    folder_ = mkdtemp(folder.data());
  }
  ~LibraryTrial() override { fs::remove_all(folder_); }

  static std::string error_of(const std::string& library) {
    try {
      find_component("guests::Good", library);
      return "no error";
    } catch (const Error& error) {
      return error.what();
    }
  }

  fs::path folder_;
};

TEST_F(LibraryTrial, RefusesWhatIsNoFile) {
  const fs::path fifo = folder_ / "libfifo.so";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(error_of(fifo),
            "library '" + fifo.string() +
                "' cannot be loaded: this is a FIFO or a pipe; name a regular file");
  EXPECT_THAT(error_of("/dev/zero"), HasSubstr("this is a device; name a regular file"));
  EXPECT_THAT(error_of(folder_.string()), HasSubstr("this is a directory"));
}

// Whatever is cut off: ends of sections, of segments, of the headers themselves.
TEST_F(LibraryTrial, RefusesWhatIsCutOff) {
  const auto size = fs::file_size(TAKT_TEST_COMPONENTS);
  for (int part = 0; part < 16; ++part) {
    const fs::path cut = folder_ / ("libcut_" + std::to_string(part) + ".so");
    fs::copy_file(TAKT_TEST_COMPONENTS, cut);
    fs::resize_file(cut, part == 15 ? size - 1 : size * part / 15);
    EXPECT_THAT(error_of(cut), HasSubstr("cannot be loaded: ")) << part;
    if (part > 0) {
      EXPECT_THAT(error_of(cut), HasSubstr("its headers promise more than its ")) << part;
    }
  }
}

// In a sourced shell it was loaded, with ROS 2's middleware; elsewhere dlopen named a missing file.
TEST_F(LibraryTrial, RefusesWhatIsBuiltAgainstRclcpp) {
  const fs::path library = folder_ / "libtalker.so";
  std::ifstream original(TAKT_TEST_COMPONENTS, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(original), {});
  const std::string needed("libstdc++.so.6"), rclcpp("librclcpp.so\0\0", needed.size());
  for (std::size_t at = 0; (at = bytes.find(needed, at)) != bytes.npos;) {
    bytes.replace(at, needed.size(), rclcpp);
  }
  std::ofstream(library, std::ios::binary) << bytes;
  EXPECT_EQ(error_of(library),
            "library '" + library.string() +
                "' cannot be loaded: it is built against rclcpp: it needs librclcpp.so; build its "
                "source against Takt (docs/how_to/port_from_rclcpp.md)");
}

TEST_F(LibraryTrial, RefusesAnInitialiserThatThrowsOrEndsItsProcess) {
  EXPECT_THAT(error_of(TAKT_THROWING_COMPONENTS),
              AllOf(HasSubstr("cannot be loaded: a process that tried it was ended by signal 6"),
                    HasSubstr("no camera"), HasSubstr("must return, and throw nothing")));
  EXPECT_THAT(error_of(TAKT_CRASHING_COMPONENTS),
              HasSubstr("a process that has loaded it was ended by signal 6 (Aborted); its static "
                        "destructors must return, and not crash"));
  EXPECT_THAT(error_of(TAKT_ENDING_COMPONENTS),
              HasSubstr("a process that tried it has ended with status 0"));
}

TEST_F(LibraryTrial, RefusesAnInitialiserThatNeverReturns) {
  try {
    try_library(TAKT_HANGING_COMPONENTS, 100ms);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "a process that tried it was not done after 0.1 s; its static "
                 "initialisers must return");
  }
}

// A program that ignores SIGCHLD cannot learn how a child process ended.
TEST_F(LibraryTrial, NeedsNoStatusOfItsProcess) {
  const auto before = signal(SIGCHLD, SIG_IGN);
  EXPECT_NO_THROW(try_library(TAKT_TEST_COMPONENTS, 60s));
  EXPECT_THROW(try_library(TAKT_THROWING_COMPONENTS, 60s), Error);
  signal(SIGCHLD, before);
}

}  // namespace
}  // namespace takt::test
