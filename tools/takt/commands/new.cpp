// takt new: writes a project that builds, to begin with.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/version.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/message_types.hpp"

#include "commands.hpp"
#include "embedded.hpp"
#include "exit_status.hpp"

namespace takt::tools::new_command {
namespace {

namespace fs = std::filesystem;

/// The name becomes a part of others, so it may be a word of C++: NAME_components is the namespace
/// and a library, NAME_msgs the package of the message.
void check_name(const std::string& name) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz", kOthers = "0123456789_";
  const auto is_letter = [&](char letter) { return kLetters.find(letter) != kLetters.npos; };
  const auto is_permitted = [&](char letter) {
    return is_letter(letter) || kOthers.find(letter) != kOthers.npos;
  };
  const bool is_name = !name.empty() && is_letter(name.front()) && name.find("__") == name.npos &&
                       std::all_of(name.begin(), name.end(), is_permitted);
  if (!is_name) {
    throw UsageError(fmt::format("'{}' cannot be the name of a project", name),
                     "write small letters, digits and single '_', a letter first: my_robot");
  }
  const std::vector<std::string> known = message_types().names();
  const auto is_of_package = [&](const std::string& type) {
    return type.starts_with(name + "_msgs/");
  };
  if (name == "takt" || std::any_of(known.begin(), known.end(), is_of_package)) {
    throw UsageError(fmt::format("'{0}' has a meaning in Takt, or {0}_msgs in ROS 2", name),
                     fmt::format("choose another name: my_{}", name));
  }
}

std::string filled(std::string text, const std::string& name) {
  const std::string version = TAKT_VERSION;
  const std::pair<std::string_view, std::string> values[] = {
      {"@NAME@", name}, {"@VERSION@", version.substr(0, version.rfind('.'))}};
  for (const auto& [mark, value] : values) {
    for (std::size_t at = 0; (at = text.find(mark, at)) != text.npos; at += value.size()) {
      text.replace(at, mark.size(), value);
    }
  }
  return text;
}

void write_project(const std::string& name) {
  check_name(name);
  std::error_code failed;
  if (!fs::create_directory(name, failed)) {
    throw UsageError(failed
                         ? fmt::format("the folder '{}' cannot be made: {}", name, failed.message())
                         : fmt::format("the folder '{}' exists, and is not changed", name),
                     "choose another name, or another folder to be in");
  }
  begin_work();
  for (const auto& [path, text] : kNewProject) {
    const std::string file = path == "system.yaml" ? name + ".yaml" : std::string(path);
    const fs::path target = fs::path(name) / file;
    fs::create_directories(target.parent_path());
    OutputFile project_file(target.string(), OutputFile::Whose::person);
    project_file.write(filled(std::string(text), name));
    project_file.complete();
  }
  rt::print(
      "written: {0}: CMakeLists.txt, two components in src, a message in msg, {0}.yaml\n\n"
      "  cmake -S {0} -B {0}/build && cmake --build {0}/build && ctest --test-dir {0}/build\n"
      "  TAKT_COMPONENT_PATH=$PWD/{0}/build takt run {0}/{0}.yaml --duration 10s\n",
      name);
}

void set_up(CLI::App* command) {
  const auto name = std::make_shared<std::string>();
  command->add_option("NAME", *name, "Its name, and that of the folder, which must not exist")
      ->required();
  command->footer("Example:\n  takt new my_robot\n");
  command->callback([name] { write_project(*name); });
}
const Command registered(
    "new", "Writes a project that builds: components, a message, a configuration file, a test",
    set_up);

}  // namespace
}  // namespace takt::tools::new_command
