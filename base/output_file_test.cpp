// What an output may overwrite, and what is there until it is complete.
// SPDX-License-Identifier: Apache-2.0
#include "takt/base/output_file.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/base/temporary.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

const std::string kJson = std::string(kTaktsJson) + "[1]";

class Output : public testing::Test {
 protected:
  std::string put(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  static std::string text_of(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  std::size_t files() const {
    const fs::directory_iterator all(folder_ / "");
    return static_cast<std::size_t>(std::distance(begin(all), end(all)));
  }
  const TemporaryFolder folder_;
};

TEST_F(Output, IsANewFileOrOneThatTaktWrote) {
  write_output(folder_ / "new.json", kJson);
  EXPECT_EQ(text_of(folder_ / "new.json"), kJson);
  write_output(folder_ / "new.json", std::string(kTaktsJson) + "{}");
  EXPECT_EQ(text_of(folder_ / "new.json"), std::string(kTaktsJson) + "{}");
  for (const char* const text :
       {"", "\t \t {\"a\": 1}", "# Written by takt random\na: 1\n",
        "// Written by takt\ndigraph {}", "<!doctype html><!-- Written by takt --><html>",
        "<?xml version=\"1\"?><!-- Written by takt -->",
        "file,executor,scheduler,composition,repeat,seconds\n",
        "file,executor,placement,scheduler,composition,repeat,seconds\n",
        "{\"a\": {\"b\": [\"takt\", \"\\\"\"]}, \"takt\": {\"version\": \"0.1\"}}"}) {
    const std::string path = put("old", text);
    EXPECT_NO_THROW(OutputFile::check(path)) << text;
    write_output(path, kJson);
    EXPECT_EQ(text_of(path), kJson);
  }
  EXPECT_EQ(files(), 2u);
}

TEST_F(Output, IsNoFileOfAPerson) {
  for (const char* const text :
       {"x", "{}", "[1]", "threads: {}\n", "# takt robot\n", "<html>", "file,executor\n",
        "{\"a\": {\"takt\": 1}, \"b\": \"takt\"}", "{\"takt\\u0020\": 1}", "{\"\\\\takt\": 1}",
        "{\"xtakt\": 1, \"takts\": 1}", "\x89MCAP0\r\nother"}) {
    const std::string path = put("mine", text);
    const auto is_refused = ThrowsMessage<Error>(HasSubstr("mine: this file exists, and takt did"));
    EXPECT_THAT([&] { OutputFile::check(path); }, is_refused) << text;
    EXPECT_THAT([&] { write_output(path, kJson); }, is_refused) << text;
    EXPECT_EQ(text_of(path), text);
  }
  // Nor through a link.
  fs::create_symlink(folder_ / "mine", folder_ / "link");
  EXPECT_THROW(write_output(folder_ / "link", kJson), Error);
  EXPECT_EQ(files(), 2u);
}

TEST_F(Output, NeverIsAFileThatTheProcessHasRead) {
  const std::string path = put("in.json", kJson);
  fs::create_hard_link(path, folder_ / "other_name");
  EXPECT_NO_THROW(OutputFile::check(folder_ / "other_name"));
  read_text(path, 100);
  EXPECT_THAT([&] { OutputFile::check(folder_ / "other_name"); },
              ThrowsMessage<Error>(HasSubstr("is an input of the same command")));
  EXPECT_THROW(write_output(path, kJson), Error);
}

TEST_F(Output, LeavesTheOldContentUntilItIsComplete) {
  const std::string path = put("old", kJson);
  chmod(path.c_str(), 0640);
  fs::create_symlink("old", folder_ / "link");
  {
    OutputFile file(folder_ / "link");
    file.write(std::string(kTaktsJson) + "{}");
    EXPECT_EQ(text_of(path), kJson);
  }
  EXPECT_EQ(text_of(path), kJson);
  EXPECT_EQ(files(), 2u);
  {
    OutputFile file(folder_ / "link");
    file.write(std::string(kTaktsJson) + "{}");
    file.complete();
  }
  EXPECT_EQ(text_of(path), std::string(kTaktsJson) + "{}");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  struct stat about {};
  stat(path.c_str(), &about);
  EXPECT_EQ(about.st_mode & 07777, 0640u);
  { const OutputFile file(folder_ / "new"); }
  EXPECT_EQ(files(), 2u);
}

TEST_F(Output, MayBeADeviceOrAPipe) {
  EXPECT_NO_THROW(write_output("/dev/null", kJson));
  EXPECT_THAT([] { write_output("/dev/full", kJson); },
              ThrowsMessage<std::runtime_error>(HasSubstr("could not be written")));
  const std::string path = folder_ / "pipe";
  mkfifo(path.c_str(), 0600);
  std::string read;
  std::jthread reader([&] { read = text_of(path); });
  write_output(path, kJson);
  reader.join();
  EXPECT_EQ(read, kJson);
}

TEST_F(Output, ThatCannotBeWrittenIsAnError) {
  for (const std::string& path : {folder_ / "none/x", std::string("/proc/none/x"), folder_ / ""}) {
    EXPECT_THROW(OutputFile::check(path), Error) << path;
    EXPECT_THROW(write_output(path, kJson), Error) << path;
  }
}

TEST_F(Output, WithoutAMarkIsAMistakeOfTakt) {
  EXPECT_THROW(write_output(folder_ / "x", "{}"), std::logic_error);
  EXPECT_EQ(files(), 0u);
}

TEST_F(Output, OfAPersonIsNew) {
  {
    OutputFile file(folder_ / "robot.yaml", OutputFile::Whose::person);
    file.write("threads: {}\n");
    file.complete();
  }
  EXPECT_EQ(text_of(folder_ / "robot.yaml"), "threads: {}\n");
  EXPECT_THROW(OutputFile(folder_ / "robot.yaml", OutputFile::Whose::person), Error);
  EXPECT_EQ(text_of(folder_ / "robot.yaml"), "threads: {}\n");
}

// The process permits it until its end, so it is one of its own.
TEST_F(Output, MayBeAFileOfAPersonByForceButNoInput) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "exit of a fork waits for the logger's thread, which is not there";
#endif
  const std::string mine = put("mine", "x"), input = put("input", "y");
  EXPECT_EXIT(
      {
        OutputFile::permit_overwriting();
        write_output(mine, kJson);
        read_text(input, 10);
        try {
          write_output(input, kJson);
        } catch (const Error&) {
          std::exit(text_of(mine) == kJson && text_of(input) == "y" ? 7 : 1);
        }
        std::exit(2);
      },
      testing::ExitedWithCode(7), "");
}

}  // namespace
}  // namespace takt
