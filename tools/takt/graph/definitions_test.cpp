// Definitions are files of others: those that are wrong are errors, which come soon.
// SPDX-License-Identifier: Apache-2.0
#include "graph/definitions.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "takt/base/error.hpp"
#include "takt/base/temporary.hpp"

namespace takt::tools {
namespace {

using testing::HasSubstr;

class DefinitionFiles : public testing::Test {
 protected:
  DefinitionFiles() {
    std::filesystem::create_directories(folder_ / "share/fz/msg");
    setenv("AMENT_PREFIX_PATH", (folder_ / "").c_str(), 1);
  }
  ~DefinitionFiles() override { unsetenv("AMENT_PREFIX_PATH"); }

  std::string path(const std::string& name) const {
    return folder_ / ("share/fz/msg/" + name + ".msg");
  }
  void add(const std::string& name, const std::string& text) { std::ofstream(path(name)) << text; }
  static std::string error_of(const std::string& name) {
    try {
      const auto type = defined("fz/msg/" + name);
      return type ? "none" : "there is no such type";
    } catch (const Error& error) {
      return error.what();
    }
  }

  const TemporaryFolder folder_;
};

// `takt interface show` printed 423 MB of a type that contains itself, and ended by SIGSEGV.
TEST_F(DefinitionFiles, ThatContainThemselvesAreRefused) {
  add("Self", "Self s\n");
  add("List", "List[] s\n");
  add("A", "B b\n");
  add("B", "A a\n");
  for (const char* name : {"Self", "List", "A", "B"}) {
    EXPECT_THAT(error_of(name), HasSubstr("contains itself")) << name;
    EXPECT_THROW(check_definition(std::string("fz/msg/") + name), Error) << name;
  }
}

// Constants have no size, and were passed over when it was asked whether a type ends.
TEST_F(DefinitionFiles, WithConstantsOfMessagesAreRefused) {
  add("Self", "Self s=1000000\n");
  EXPECT_THAT(error_of("Self"), HasSubstr("has the constant 'Self s=1000000' of a message's type"));
  EXPECT_THROW(check_definition("fz/msg/Self"), Error);
}

TEST_F(DefinitionFiles, ThatAreDeepOrLargeAreRefused) {
  for (int i = 0; i < 3000; ++i) add(fmt::format("D{}", i), fmt::format("D{} a\n", i + 1));
  add("D3000", "int32 x\n");
  EXPECT_THAT(error_of("D0"), HasSubstr("too deeply"));
  EXPECT_EQ(error_of("D2950"), "none");
  for (int i = 0; i < 40; ++i) add(fmt::format("X{}", i), fmt::format("X{0} a\nX{0} b\n", i + 1));
  add("X40", "int32 x\n");
  EXPECT_THAT(error_of("X0"), HasSubstr("is too large"));
  EXPECT_EQ(error_of("X35"), "none");
  add("N1", "N2[60000] x\n");
  add("N2", "uint8[60000] x\n");
  add("Bytes", "uint8[18446744073709551615] x\n");
  for (const char* name : {"N1", "Bytes"}) {
    EXPECT_THAT(error_of(name), HasSubstr("is too large")) << name;
  }
  EXPECT_EQ(error_of("N2"), "none");
}

TEST_F(DefinitionFiles, WithWrongSizesAreRefused) {
  add("Bound", "string<=99999999999999999999999 s\n");
  add("Zero", "uint8[0] x\n");
  add("Negative", "uint8[-1] x\n");
  for (const char* name : {"Bound", "Zero", "Negative"}) {
    EXPECT_THAT(error_of(name), HasSubstr(fmt::format("fz/msg/{}: a definition has", name)));
  }
}

TEST_F(DefinitionFiles, WithWrongNamesOrValuesAreRefused) {
  const std::map<std::string, std::string> wrong{
      {"int32 x\nint32 x\n", "has 'x' twice"},
      {"int32 X=1\nint32 x\nint8 X=2\n", "has 'X' twice"},
      {"int32 a\033[31m\n", "not of letters"},
      {"int8 X=99999\n", "gives 'X' the value '99999', which is not one of int8"},
      {"uint16 x -1\n", "gives 'x' the value '-1', which is not one of uint16"},
      {"float64 X=one\n", "which is not one of float64"},
      {"int32 X=\n", "gives 'X' the value ''"},
      {"int8[<=3] list 1\n", "gives 'list' the value '1', which is no list"},
      {"Right[] x 1\n", "gives 'x' a value, and "}};
  add("Right", "int8 X=-128\nuint8 Y=+255\nfloat32 z 1e3\nstring s 'x'\nint32[] list [1, 2]\n");
  for (const auto& [text, why] : wrong) {
    add("Wrong", text);
    EXPECT_THAT(error_of("Wrong"), HasSubstr(why));
  }
  EXPECT_EQ(error_of("Right"), "none");
}

// With more parts than its kind has, `takt interface show --json` wrote behind a list.
TEST_F(DefinitionFiles, WithTooManyPartsAreRefused) {
  add("Parts", "int32 x\n---\nint32 y\n");
  EXPECT_THAT(error_of("Parts"), HasSubstr("too many lines of '---'"));
}

// A FIFO held the command up, and /dev/zero filled the memory.
TEST_F(DefinitionFiles, ThatAreNoRegularFilesAreRefused) {
  ASSERT_EQ(mkfifo(path("Fifo").c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/zero", path("Zero"));
  add("Sparse", "");
  std::filesystem::resize_file(path("Sparse"), std::uintmax_t{1} << 33U);
  EXPECT_THAT(error_of("Fifo"), HasSubstr("share/fz/msg/Fifo.msg: this is a FIFO"));
  EXPECT_THAT(error_of("Zero"), HasSubstr("this is a device"));
  EXPECT_THAT(error_of("Sparse"), HasSubstr("larger than 1 MiB"));
  EXPECT_EQ(error_of("../msg/Fifo"), "there is no such type");
}

}  // namespace
}  // namespace takt::tools
