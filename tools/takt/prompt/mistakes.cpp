// SPDX-License-Identifier: Apache-2.0
#include "prompt/mistakes.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"

namespace takt::tools {
namespace {

/// From `takt` to the last command that was named.
std::vector<const CLI::App*> named(const CLI::App& app) {
  std::vector<const CLI::App*> path{&app};
  while (!path.back()->get_subcommands().empty()) {
    path.push_back(path.back()->get_subcommands().front());
  }
  return path;
}

std::vector<std::string> options_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* const option : command.get_options()) {
    if (option->get_group().empty()) continue;  // one for our own processes, or a removed one
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

std::string see_help(const CLI::App& command) {
  return fmt::format("see {} --help", full_name(command));
}

/// Whether the words begin with the command: all that follow are for it. CLI11 hands those after
/// `--` to the parent of a command that takes no more.
bool begins_with(const std::vector<std::string>& words, const std::vector<const CLI::App*>& path) {
  const auto is_name = [](const CLI::App* command, const std::string& word) {
    return command->get_name() == word;
  };
  return words.size() + 1 >= path.size() &&
         std::equal(path.begin() + 1, path.end(), words.begin(), is_name);
}

std::string unexpected(const CLI::App& command, const std::string& word) {
  const std::string name = full_name(command);
  if (word.starts_with('-') && word.size() > 1) {
    return fmt::format("{} has no option '{}'; {}", name, word,
                       suggest(word.substr(0, word.find('=')), options_of(command)));
  }
  const std::vector<std::string> commands = commands_of(command);
  if (!commands.empty()) {
    return fmt::format("{} has no command '{}'; {}", name, word, suggest(word, commands));
  }
  return fmt::format("'{}' is one word too many for {}; leave it out, or {}", word, name,
                     see_help(command));
}

/// "--load" of "--load: 1 required TEXT missing".
std::string begin_of(std::string_view text, std::string_view end) {
  return std::string(text.substr(0, text.find(end)));
}

/// "-q" of "-=1", which is what CLI11 leaves of "-q=1"; empty: it is another word.
std::string flag_before(std::string_view left, const std::vector<std::string>& given) {
  if (!left.starts_with("-=")) return {};
  const auto is_it = [&](std::string_view word) {
    return word.starts_with('-') && !word.starts_with("--") && word.ends_with(left.substr(1));
  };
  const auto found = std::find_if(given.begin(), given.end(), is_it);
  return found != given.end() ? found->substr(0, found->find('=')) : "";
}

}  // namespace

std::vector<std::string> commands_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* const each : command.get_subcommands([](const CLI::App*) { return true; })) {
    if (!each->get_group().empty()) names.push_back(each->get_name());
  }
  return names;
}

std::string full_name(const CLI::App& command) {
  const std::string own = command.get_name();
  return command.get_parent() == nullptr ? own : full_name(*command.get_parent()) + " " + own;
}

std::string mistake(const CLI::App& app, const CLI::ParseError& error,
                    const std::vector<std::string>& given) {
  const std::vector<const CLI::App*> path = named(app);
  const CLI::App& command = *path.back();
  const std::string what = error.what();
  const bool is_missing = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  if (is_missing || dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    for (const CLI::App* const each : path) {
      const std::vector<std::string> words = each->remaining();
      if (words.empty()) continue;
      if (const std::string flag = flag_before(words.front(), given); !flag.empty()) {
        return fmt::format("{0} takes no value; write {0}", flag);
      }
      return unexpected(begins_with(given, path) ? command : *each, words.front());
    }
  }
  if (is_missing && what.find("subcommand") != what.npos) {
    return fmt::format("{} needs a command; one of: {}", full_name(command),
                       fmt::join(commands_of(command), ", "));
  }
  if (is_missing) {
    return fmt::format("{} needs {}; {}", full_name(command), begin_of(what, " is required"),
                       see_help(command));
  }
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    const std::size_t flag = what.find(" was given a disallowed");
    if (flag != what.npos) {  // CLI11 leaves the dashes out
      return fmt::format("{0} takes no value; write {0}",
                         (flag == 1 ? "-" : "--") + what.substr(0, flag));
    }
    const bool is_twice = what.find("At Most") != what.npos;
    return fmt::format("{} {}; {}", begin_of(what, ":"),
                       is_twice ? "is given more than once" : "needs a value", see_help(command));
  }
  if (dynamic_cast<const CLI::ExcludesError*>(&error) != nullptr) {
    return fmt::format("{} cannot be given with {}; leave one out", begin_of(what, " excludes "),
                       what.substr(what.rfind(' ') + 1));
  }
  if (dynamic_cast<const CLI::RequiresError*>(&error) != nullptr) {
    return fmt::format("{0} is for {1} only; give {1}, or leave {0} out",
                       begin_of(what, " requires "), what.substr(what.rfind(' ') + 1));
  }
  return what.find(';') == what.npos ? what + "; " + see_help(command) : what;
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  if (option->get_type_size() == 0 || option->get_positional()) return "";
  const bool is_list = option->get_expected_max() == CLI::detail::expected_max_vector_size &&
                       option->get_allow_extra_args();
  return " " + option->get_type_name() + (is_list ? " ..." : "");
}

}  // namespace takt::tools
