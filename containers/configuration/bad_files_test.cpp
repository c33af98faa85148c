// The collection of wrong files in testdata/bad: beside each NAME.yaml or NAME.json lies, as
// NAME.txt, what `takt check` says about it.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/executors/executor.hpp"
#include "takt/sched/scheduler.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFewest = 50;  // that the collection must have

std::vector<std::string> wrong_files() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(TAKT_BAD_FILES, none)) {
    if (entry.path().extension() != ".txt") names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

// What depends on the machine, or on what this program has loaded, has a name in angle brackets.
std::string portable(std::string text) {
  text = replaced(std::move(text), TAKT_BAD_FILES "/", "");
  static const std::regex kComponents("valid: [^;\n]*; others are");
  text = std::regex_replace(text, kComponents, "valid: <components>; others are");
  const std::pair<std::string, std::string> lists[] = {
      {fmt::format("valid: {}\n", fmt::join(executors().names(), ", ")), "valid: <executors>\n"},
      {fmt::format("valid: {}\n", fmt::join(schedulers().names(), ", ")), "valid: <schedulers>\n"},
      {fmt::format("choose from {}\n", fmt::join(available_cpus(), ", ")), "choose from <CPUs>\n"}};
  for (const auto& [list, name] : lists) text = replaced(std::move(text), list, name);
  return text;
}

std::string errors_of_file(const fs::path& file) {
  try {
    read_system(file);
    return "no error\n";
  } catch (const ConfigurationError& error) {
    return portable(std::string(error.what()) + "\n");
  }
}

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator(stream), {}};
}

class WrongFile : public testing::TestWithParam<std::string> {};

TEST_P(WrongFile, YieldsTheMessageBesideIt) {
  provide_workload();
  const fs::path file = fs::path(TAKT_BAD_FILES) / GetParam();
  const fs::path beside = fs::path(file).replace_extension(".txt");
  const std::string errors = errors_of_file(file);
  EXPECT_NE(errors, "no error\n") << "a file of this collection is wrong";
  if (std::getenv("TAKT_RENEW_MESSAGES") != nullptr) std::ofstream(beside) << errors;
  ASSERT_TRUE(fs::exists(beside)) << "it needs " << beside;
  EXPECT_EQ(errors, content(beside))
      << "If the new message is the better one: TAKT_RENEW_MESSAGES=1 containers_test "
         "--gtest_filter='*WrongFile*', and read what git diff shows.";
}

INSTANTIATE_TEST_SUITE_P(Each, WrongFile, testing::ValuesIn(wrong_files()),
                         [](const auto& file) { return fs::path(file.param).stem().string(); });

TEST(WrongFiles, AreMany) {
  EXPECT_GE(wrong_files().size(), kFewest);
}

TEST(WrongFiles, AreThereForEachMessage) {
  std::vector<std::string> stems;
  for (const std::string& name : wrong_files()) stems.push_back(fs::path(name).stem());
  EXPECT_EQ(std::adjacent_find(stems.begin(), stems.end()), stems.end()) << "two share a message";
  for (const auto& entry : fs::directory_iterator(TAKT_BAD_FILES)) {
    EXPECT_EQ(std::count(stems.begin(), stems.end(), entry.path().stem()), 1) << entry.path();
  }
}

}  // namespace
}  // namespace takt
