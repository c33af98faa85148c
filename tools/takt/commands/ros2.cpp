// takt ros2: builds packages written for rclcpp on Takt.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/containers/component.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"

namespace takt::tools::ros2_command {
namespace {

namespace fs = std::filesystem;

/// Beside the library: in the build tree as where it is installed.
fs::path prefix() {
  Dl_info own{};
  dladdr(reinterpret_cast<const void*>(&components), &own);
  std::error_code none;
  const fs::path takt = fs::canonical(own.dli_fname != nullptr ? own.dli_fname : "", none);
  fs::path result = takt.parent_path() / "takt" / "ros2";
  if (!fs::is_directory(result, none)) {
    throw Error(fmt::format("there is no folder '{}'", result.string()),
                "install Takt whole: the layer for rclcpp is a part of it");
  }
  return result;
}

// Replaces this process: the rest is a script, as package.xml is to be read.
void build(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"python3", prefix() / "share/takt_ros2/cmake/build.py"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execvp(argv.front(), argv.data());
  throw Error(fmt::format("python3 cannot be started: {}", std::generic_category().message(errno)),
              "on Debian: apt-get install python3");
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  command->footer(
      "Example:\n"
      "  cmake -S my_package -B build -D CMAKE_PREFIX_PATH=$(takt ros2 prefix)\n"
      "  takt ros2 build src\n");
  CLI::App* const where = command->add_subcommand(
      "prefix", "Prints the folder for CMAKE_PREFIX_PATH with which a package builds on Takt");
  where->callback([] { rt::print("{}\n", prefix().string()); });

  CLI::App* const made = command->add_subcommand(
      "build",
      "Builds packages in the order of their package.xml; `build --help` lists its options");
  made->set_help_flag();  // the script has its own
  made->prefix_command();
  made->callback([made] { build(made->remaining()); });
}
const Command registered("ros2", "Builds packages written for rclcpp, unchanged, on Takt", set_up);

}  // namespace
}  // namespace takt::tools::ros2_command
