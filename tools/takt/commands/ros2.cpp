// takt ros2: builds packages written for rclcpp on Takt, and runs their programs.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/file_place.hpp"
#include "takt/base/printable.hpp"
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

/// Does not return. `advice`: if it cannot be started.
[[noreturn]] void replace_this_process(std::vector<std::string> words, const char* advice) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execvp(argv.front(), argv.data());
  throw Error(fmt::format("{} cannot be started: {}", words.front(), errno_message(errno)), advice);
}

// The rest is a script, as package.xml is to be read.
void build(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"python3", "-I", prefix() / "share/takt_ros2/cmake/build.py"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  replace_this_process(std::move(words), "on Debian: apt-get install python3");
}

/// Where `takt ros2 build` installs, in the folder that it is called in.
constexpr const char* kInstall = "install";

struct Program {
  std::string package, name, install_base;  // empty: not named
  std::vector<std::string> arguments;
};

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (entry.is_regular_file(none) && access(entry.path().c_str(), X_OK) == 0) {
      names.push_back(entry.path().filename());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// Whether a program of ./install may be started, which nobody has named: else takt in /tmp would
/// run what another user has put there.
bool is_ours(const fs::path& program) {
  try {
    check_ours(program);
    return true;
  } catch (const Error& error) {
    rt::to_stderr(
        "note: './{}' is left out, as {}; if it is to be used, name it: --install-base {}\n",
        kInstall, error.what(), kInstall);
    return false;
  }
}

/// What takt ros2 build has installed comes before a ROS 2 in the environment.
fs::path find(const Program& program) {
  const bool is_named = !program.install_base.empty();
  std::vector<fs::path> prefixes{is_named ? program.install_base : kInstall};
  if (const char* const path = std::getenv("AMENT_PREFIX_PATH")) {
    std::istringstream parts(path);
    for (std::string part; std::getline(parts, part, ':');) {
      if (!part.empty()) prefixes.emplace_back(part);
    }
  }
  std::set<std::string> packages, programs;  // a folder may be named twice
  for (const fs::path& folder : prefixes) {
    const std::vector<std::string> names = names_in(folder / "lib" / program.package);
    if (std::find(names.begin(), names.end(), program.name) != names.end()) {
      const fs::path found = fs::absolute(folder / "lib" / program.package / program.name);
      if (is_named || folder != kInstall || is_ours(found)) return found;
      continue;
    }
    programs.insert(names.begin(), names.end());
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder / "lib", none)) {
      if (!names_in(entry.path()).empty()) packages.insert(entry.path().filename());
    }
  }
  if (!programs.empty()) {
    throw Error(
        fmt::format("package '{}' has no program '{}'", program.package, printable(program.name)),
        suggest(program.name, std::vector(programs.begin(), programs.end())));
  }
  throw Error(fmt::format("no package '{}' with programs is installed in '{}' or a prefix of "
                          "AMENT_PREFIX_PATH",
                          printable(program.package), printable(prefixes.front().string())),
              packages.empty()
                  ? "build it with `takt ros2 build`, or name the folder with "
                    "--install-base"
                  : suggest(program.package, std::vector(packages.begin(), packages.end())));
}

void run(const Program& program) {
  std::vector<std::string> words{find(program)};
  words.insert(words.end(), program.arguments.begin(), program.arguments.end());
  replace_this_process(std::move(words), "build its package again");
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  command->footer(
      "Example:\n"
      "  takt ros2 prefix\n"
      "  cmake -S my_package -B build -D CMAKE_PREFIX_PATH=$(takt ros2 prefix)\n"
      "  takt ros2 build src\n"
      "  takt ros2 run my_package my_program --ros-args -p rate:=10\n");
  CLI::App* const where = command->add_subcommand(
      "prefix", "Prints the folder for CMAKE_PREFIX_PATH with which a package builds on Takt");
  where->callback([] { rt::print("{}\n", prefix().string()); });

  CLI::App* const made = command->add_subcommand(
      "build",
      "Builds packages in the order of their package.xml; `build --help` lists its options");
  made->set_help_flag();  // the script has its own
  made->prefix_command();
  made->callback([made] { build(made->remaining()); });

  const auto program = std::make_shared<Program>();
  CLI::App* const started =
      command->add_subcommand("run", "Runs a program of an installed package");
  started->positionals_at_end();  // what follows is the program's
  started->add_option(
      "--install-base", program->install_base,
      "Where `takt ros2 build` has installed it, before AMENT_PREFIX_PATH (default: "
      "install, if nobody but this user and root can change it)");
  started->add_option("PACKAGE", program->package, "Its name")->required();
  started->add_option("EXECUTABLE", program->name, "The program's name")->required();
  started->add_option("ARGUMENT", program->arguments, "For the program");
  started->callback([program] { run(*program); });
}
const Command registered("ros2", "Builds and runs packages written for rclcpp, unchanged, on Takt",
                         set_up);

}  // namespace
}  // namespace takt::tools::ros2_command
