// Every output of every command: what it overwrites, and what not.
// SPDX-License-Identifier: Apache-2.0
#include "outputs.hpp"

#include <fstream>
#include <memory>
#include <sstream>

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/temporary.hpp"

#include "commands.hpp"

namespace takt::tools::outputs_test {
namespace {

using Words = std::vector<std::string>;

/// Thrown where a command would begin.
struct Begins {};

class Takt {
 public:
  Takt() {
    set_up(app_);
    app_.parse_complete_callback([] { throw Begins(); });
  }
  /// What it says of these words; empty: it would begin.
  std::string said(const Words& words) {
    try {
      app_.parse(Words(words.rbegin(), words.rend()));
    } catch (const Begins&) {
      return "";
    } catch (const std::exception& error) {
      return error.what();
    }
    return "it did not begin";
  }

 private:
  CLI::App app_{"Takt", "takt"};
};

/// The command with all that it must be given.
Words least_words(const CLI::App* command) {
  Words words;
  for (const CLI::App* each = command; each->get_parent() != nullptr; each = each->get_parent()) {
    words.insert(words.begin(), each->get_name());
  }
  for (const CLI::Option* option : command->get_options()) {
    if (!option->get_required()) continue;
    if (!option->get_positional()) words.push_back(option->get_name());
    const std::string type = option->get_type_name();
    const bool is_words = type.find('|') != std::string::npos;
    words.push_back(is_words ? type.substr(0, type.find('|')) : "1");
  }
  return words;
}

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST(Outputs, OfEveryCommandOverwriteNoFileOfAPersonAndNoInput) {
  struct Case {
    Words words;
    std::string option;
    std::vector<std::string> files;  // of the value that follows
    std::string value;
  };
  const TemporaryFolder folder;
  std::vector<Case> cases;
  {
    CLI::App app("Takt", "takt");
    for (const auto outputs = set_up(app); const OutputOption& output : outputs->options) {
      const std::string value = folder / "out.html";
      std::vector<std::string> files = output.files(value);
      std::string is = value;
      if (files.empty()) is = folder / "";  // it names a folder
      files = output.files(is);
      ASSERT_FALSE(files.empty()) << output.option->get_name();
      cases.push_back({least_words(output.command), output.option->get_name(), files, is});
    }
  }
  EXPECT_GT(cases.size(), 40u);
  const std::string other = folder / "other.json", ours = std::string(kTaktsJson) + "[]";
  for (const Case& one : cases) {
    Words words = one.words;
    words.insert(words.end(), {one.option, one.value});
    SCOPED_TRACE(testing::PrintToString(words));
    EXPECT_EQ(Takt().said(words), "") << "a new file";
    for (const std::string& file : one.files) {
      std::ofstream(file) << "mine";
      EXPECT_NE(Takt().said(words).find("takt did not write it"), std::string::npos);
      EXPECT_EQ(text_of(file), "mine");
      std::ofstream(file) << ours;
      EXPECT_EQ(Takt().said(words), "") << "one of takt's";
      // Any other word of the command that names the same file.
      std::filesystem::create_hard_link(file, other);
      Words twice = words;
      twice.insert(twice.end(), {"--json", other});
      const std::string said = Takt().said(twice);
      if (one.option != "--json") {
        EXPECT_TRUE(said.find("named twice") != std::string::npos ||
                    said.find("--json") != std::string::npos)  // it has none
            << said;
      }
      std::filesystem::remove(other);
      std::filesystem::remove(file);
    }
  }
}

TEST(Outputs, AreNoneOfTheWordsOfTheirCommand) {
  const TemporaryFolder folder;
  const std::string file = folder / "t.json";
  std::ofstream(file) << kTaktsJson << "[]";
  for (const Words& words :
       {Words{"model", file, "-o", file}, Words{"model", file, "--json", file},
        Words{"analyze", "robot.yaml", "--model", file, "--json", file},
        Words{"compare", file, "--csv", file}, Words{"bag", "info", file, "--json", file},
        Words{"run", file, "--trace", file}, Words{"rta", "fifo", file, "--json", file},
        Words{"run", "x.yaml", "--json", folder / "new", "--csv", folder / "./new"}}) {
    EXPECT_NE(Takt().said(words).find("named twice"), std::string::npos)
        << testing::PrintToString(words) << ": " << Takt().said(words);
  }
}

TEST(Outputs, AreNotCheckedOnceTheirCommandsAreDestroyed) {
  { (void)Takt().said({"list", "nodes", "--json", "out.json"}); }
  check_chosen_outputs();
}

}  // namespace
}  // namespace takt::tools::outputs_test
