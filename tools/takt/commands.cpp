// SPDX-License-Identifier: Apache-2.0
#include "commands.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <sstream>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/version.hpp"
#include "takt/containers/configuration/removed.hpp"

#include "exit_status.hpp"
#include "prompt/mistakes.hpp"
#include "prompt/values.hpp"

namespace takt::tools {
namespace {

struct Entry {
  const char* what;
  void (*set_up)(CLI::App*);
  Command::Takes takes;
};
std::map<std::string, Entry>& commands() {
  static std::map<std::string, Entry> entries;
  return entries;
}

std::vector<std::string> program;

/// Options that earlier versions had. They are not shown.
void refuse_removed(CLI::App* command) {
  const std::string name = "takt " + command->get_name();
  for (const Removed& option : kRemoved) {
    if (option.from != name) continue;
    command
        ->add_option_function<std::vector<std::string>>(
            std::string(option.name),
            [&option](const std::vector<std::string>&) {
              throw Error(fmt::format("'{}' was removed from {}", option.name, option.from),
                          std::string(option.instead));
            })
        ->expected(0, 1)
        ->group("");
  }
}

/// Those of the examples of `takt topic` that show `takt topic echo`.
std::string own_examples(const CLI::App& command) {
  std::istringstream lines(command.get_parent()->get_footer());
  const std::string begin = "  " + full_name(command);
  std::string own = "Example:\n";
  for (std::string line; std::getline(lines, line);) {
    if (line == begin || line.starts_with(begin + " ")) own += line + "\n";
  }
  return own;
}

}  // namespace

Command::Command(const char* name, const char* what, void (*set_up)(CLI::App*), Takes takes) {
  commands()[name] = {what, set_up, takes};
}

const std::vector<std::string>& program_words() {
  return program;
}

std::string with_program(const std::string& file) {
  if (program.empty()) return file;
  return fmt::format("{}{}-- {}", file, file.empty() ? "" : " ", fmt::join(program, " "));
}

int split_program(int argc, char** argv) {
  const auto command = commands().find(argc > 1 ? argv[1] : "");
  if (command == commands().end() || command->second.takes == Command::Takes::words) return argc;
  char** const end = argv + argc;
  char** const dashes = std::find(argv, end, std::string_view("--"));
  if (dashes != end) program.assign(dashes + 1, end);
  if (dashes != end && program.empty()) {
    throw UsageError("nothing follows --",
                     fmt::format("write a program: takt {} -- ./program", command->first));
  }
  return static_cast<int>(dashes - argv);
}

void set_up(CLI::App& app) {
  app.set_version_flag("--version", TAKT_VERSION);
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.footer(
      "Example:\n"
      "  takt compare robot.yaml --executors all --duration 5s\n");
  for (const auto& [name, entry] : commands()) {
    CLI::App* const command = app.add_subcommand(name, entry.what);
    entry.set_up(command);
    refuse_removed(command);
    for (CLI::App* const each : command->get_subcommands({})) {
      const std::string footer = each->get_footer();  // what it has inherited is no example of it
      const bool is_own = footer != app.get_footer() && footer != command->get_footer();
      if (!is_own) each->footer(own_examples(*each));
    }
  }
  finish_values(app);
}

}  // namespace takt::tools
