// takt: runs systems described by a file, and compares executors on them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <map>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>

#include "takt/base/error.hpp"
#include "takt/base/version.hpp"
#include "takt/containers/configuration/removed.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "exit_status.hpp"

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

/// The number of words in front of the program; the rest is kept.
int split_program(int argc, char** argv) {
  const auto command = commands().find(argc > 1 ? argv[1] : "");
  if (command == commands().end() || command->second.takes == Command::Takes::words) return argc;
  char** const end = argv + argc;
  char** const dashes = std::find(argv, end, std::string_view("--"));
  if (dashes != end) program.assign(dashes + 1, end);
  return static_cast<int>(dashes - argv);
}

void add_commands(CLI::App& app) {
  for (const auto& [name, entry] : commands()) {
    CLI::App* const command = app.add_subcommand(name, entry.what);
    entry.set_up(command);
    refuse_removed(command);
    // Without examples of their own, theirs are those of their command, not those of `takt`.
    for (CLI::App* const each : command->get_subcommands({})) {
      if (each->get_footer() == app.get_footer()) each->footer(command->get_footer());
    }
  }
}

}  // namespace takt::tools

namespace {

int run(int argc, char** argv) {
  using namespace takt;
  CLI::App app("Takt: real-time executors with swappable schedulers", "takt");
  try {
    app.set_version_flag("--version", TAKT_VERSION);
    app.require_subcommand(1);
    app.failure_message(CLI::FailureMessage::simple);
    app.footer(
        "Example:\n"
        "  takt compare robot.yaml --executors all --duration 5s\n");
    tools::add_commands(app);
    app.parse(tools::split_program(argc, argv), argv);
    return 0;
  } catch (const CLI::RuntimeError& error) {  // a command failed; not a usage error
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : tools::kBadUsage;
  } catch (const ConfigurationError& error) {
    for (const std::string& line : error.errors()) rt::to_stderr("{}\n", line);
    return tools::kBadUsage;
  } catch (const Error& error) {
    rt::to_stderr("takt: {}\n", error.what());
    const bool is_usage = dynamic_cast<const tools::UsageError*>(&error) != nullptr;
    return is_usage ? tools::kBadUsage : tools::status_of_error();
  } catch (const tools::Interrupted& interruption) {
    rt::to_stderr("takt: {}\n", interruption.what());
    return 128 + interruption.signal;
  } catch (const std::bad_alloc&) {
    throw;  // to where nothing is allocated
  } catch (const std::exception& error) {
    rt::to_stderr("takt: {}\n", tools::message_of(error));
    return tools::kFailed;
  }
}

/// Each thread that chooses no size of its own has a stack of that limit, and iceoryx keeps lists
/// of 256 KiB on it.
bool has_stack() noexcept {
  constexpr rlim_t kLeast = rlim_t{1} << 20;
  rlimit stack{};
  return getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kLeast;
}

/// Nothing is thrown out of main, neither while options are set up nor while an error is reported.
int run_in_net(int argc, char** argv) noexcept {
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fputs("takt: no memory is left; raise the limit (ulimit -v), or end other programs\n",
               stderr);
  } catch (...) {
    std::fprintf(stderr, "takt: %s\n", takt::tools::kNoStdException);
  }
  return takt::tools::kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  if (!has_stack()) {
    std::fputs("takt: stacks have less than 1 MiB; raise the limit (ulimit -s)\n", stderr);
    return takt::tools::kBadUsage;
  }
  takt::rt::guard_output();
  return takt::rt::checked_output(run_in_net(argc, argv));
}
