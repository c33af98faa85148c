// SPDX-License-Identifier: Apache-2.0
#include "commands.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <new>
#include <sstream>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/version.hpp"
#include "takt/containers/configuration/removed.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"

#include "exit_status.hpp"
#include "prompt/mistakes.hpp"
#include "prompt/values.hpp"
#include "run_takt.hpp"

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

/// The last one first, as CLI11 takes them. The value of `param set` may begin with a '-'.
std::vector<std::string> words_for_parser(int count, char** argv) {
  std::vector<std::string> words(argv + std::min(count, 1), argv + count);
  const bool is_set = words.size() == 5 && words[0] == "param" && words[1] == "set";
  if (is_set && words[4].starts_with('-') && !words[4].starts_with("--") && words[4] != "-h") {
    words.insert(words.end() - 1, "--");
  }
  return {words.rbegin(), words.rend()};
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

std::shared_ptr<const Outputs> set_up(CLI::App& app) {
  app.set_version_flag("--version", TAKT_VERSION);
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.footer(
      "Example:\n"
      "  takt compare robot.yaml --executors all --duration 5s\n");
  const std::shared_ptr<Outputs> outputs = begin_outputs();
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
  check_outputs_of(app, outputs);
  finish_values(app);
  return outputs;
}

int run_takt(int argc, char** argv) {
  CLI::App app("Takt: real-time executors with swappable schedulers", "takt");
  std::vector<std::string> words;
  try {
    set_up(app);
    const int count = split_program(argc, argv);
    words.assign(argv + std::min(count, 1), argv + count);
    app.parse(words_for_parser(count, argv));
    return 0;
  } catch (const CLI::RuntimeError& error) {  // a command failed; not a usage error
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help and --version
    rt::to_stderr("takt: {}\n", mistake(app, error, words));
    return kBadUsage;
  } catch (const ConfigurationError& error) {
    for (const std::string& line : error.errors()) rt::to_stderr("{}\n", line);
    return kBadUsage;
  } catch (const Error& error) {
    rt::to_stderr("takt: {}\n", error.what());
    const bool is_usage = dynamic_cast<const UsageError*>(&error) != nullptr;
    return is_usage ? kBadUsage : status_of_error();
  } catch (const Interrupted& interruption) {
    rt::to_stderr("takt: {}\n", interruption.what());
    return 128 + interruption.signal;
  } catch (const std::bad_alloc&) {
    throw;  // to where nothing is allocated
  } catch (const std::exception& error) {
    rt::to_stderr("takt: {}\n", message_of(error));
    return kFailed;
  }
}

}  // namespace takt::tools
