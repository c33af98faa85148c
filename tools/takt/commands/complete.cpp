// takt complete: what may stand at the end of a command line, for the completion of shells.
//
// `takt complete WORD... LAST` prints a line for each word that LAST may become, with its
// description behind a tab. The line ":files SUFFIX..." says that a file may stand there.
// Everything else is in the options that the other commands define, in what their help says, and in
// what they print.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"

namespace takt::tools::complete_command {
namespace {

struct Candidate {
  std::string word, what;
};
using Candidates = std::vector<Candidate>;

/// What another command of this program prints; empty if it fails.
std::string output_of(std::vector<std::string> words) {
  std::error_code none;
  words.insert(words.begin(), std::filesystem::read_symlink("/proc/self/exe", none));
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return {};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int failed =
      posix_spawn(&child, words.front().c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string text;
  std::array<char, 4096> part{};
  for (ssize_t got = 0; failed == 0 && (got = read(ends[0], part.data(), part.size())) > 0;) {
    text.append(part.data(), static_cast<std::size_t>(got));
  }
  close(ends[0]);
  if (failed == 0) waitpid(child, nullptr, 0);
  return text;
}

/// Whether a shell takes it as it is: `$`, quotes, `{`, `!` and the like would make it a command,
/// and a `-` at its begin an option.
bool is_plain(std::string_view word) {
  constexpr std::string_view kInside = "_/.:,+@%=-";
  const auto is_letter = [](char c) {
    return ('a' <= (c | 32) && (c | 32) <= 'z') || ('0' <= c && c <= '9');
  };
  return !word.empty() && (is_letter(word.front()) || word.front() == '/' || word.front() == '_') &&
         std::all_of(word.begin(), word.end(),
                     [&](char c) { return is_letter(c) || kInside.find(c) != kInside.npos; });
}

/// The first word of each line is a name, the others say what it is.
Candidates names_in_lines(const std::string& text) {
  Candidates names;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end = std::min(line.find(' '), line.size());
    const std::size_t what = std::min(line.find_first_not_of(' ', end), line.size());
    if (is_plain(line.substr(0, end))) names.push_back({line.substr(0, end), line.substr(what)});
  }
  return names;
}

/// What an option is called, or what its help refers to; and the command that knows the names.
struct Source {
  const char* sign;
  std::vector<std::string> words;
  const char* key = nullptr;  // of its JSON; without, it prints lines
  const char* end = "";       // of the names behind a slash: which they do not have
};
const std::vector<Source>& sources() {
  static const std::vector<Source> all{
      {"see: takt list executors", {"list", "executors"}},
      {"see: takt list schedulers", {"list", "schedulers"}},
      {"see: takt list catalogue", {"list", "catalogue"}},
      {"see: takt component types", {"component", "types", "--json", "-"}, "component"},
      // With the empty ones, which have no component to be listed.
      {"CONTAINER",
       {"service", "list", "--all", "--json", "-"},
       "service",
       "/_container/list_nodes"},
      {"NODE", {"node", "list", "--json", "-"}, "node"},
      {"TOPIC", {"topic", "list", "--json", "-"}, "topic"},
      {"SERVICE", {"service", "list", "--json", "-"}, "service"},
      {"ACTION", {"action", "list", "--json", "-"}, "action"},
  };
  return all;
}

/// The permitted words, which the help shows as `file|single`; of `TIME|off`, the word.
Candidates values_in(const std::string& type) {
  Candidates values;
  if (type.find('|') == type.npos) return values;
  std::istringstream parts(type);
  for (std::string part; std::getline(parts, part, '|');) {
    if (part.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") == part.npos) values.push_back({part, ""});
  }
  return values;
}

Candidates names_in_json(const std::string& text, const Source& source) {
  Candidates names;
  const auto rows = rt::json_or_null(text);
  if (!rows.is_array()) return names;
  const std::string_view end = source.end;
  for (const auto& row : rows) {
    if (!row.is_object()) continue;
    std::string name = row.value(source.key, "");
    // No line and no command of a terminal is made of what others on the domain have named.
    if (!name.ends_with(end) || !is_plain(name)) continue;
    if (!end.empty()) name = name.substr(1, name.size() - 1 - end.size());
    names.push_back({name, row.value("description", "")});
  }
  return names;
}

bool says(const CLI::Option& option, std::string_view part) {
  return option.get_description().find(part) != std::string::npos;
}

/// Also as one of several: "FILE|CONTAINER".
bool is_called(const CLI::Option& option, std::string_view name) {
  return fmt::format("|{}|", option.get_name(true)).find(fmt::format("|{}|", name)) !=
         std::string::npos;
}

/// The last line of the output, if a file may stand there.
std::string files_of(const CLI::Option& option) {
  if (says(option, "MCAP") || says(option, "recording")) return ":files mcap";
  const bool is_system = says(option, "onfiguration file") || says(option, "ystems to run");
  if (is_system) return ":files yaml yml json";
  return ":files";
}

class Completion {
 public:
  Completion(const CLI::App* app, const std::vector<std::string>& words) : app_(app) {
    for (std::size_t i = 0; i + 1 < words.size() && !is_other_program_; ++i) pass(words[i]);
    if (is_other_program_) {
      files_ = ":files";
    } else if (!words.empty()) {
      complete(words.back());
    }
  }

  void print() const {
    for (const auto& [word, what] : candidates_) rt::print("{}\t{}\n", word, what);
    if (!files_.empty()) rt::print("{}\n", files_);
  }

 private:
  /// A word that is complete.
  void pass(const std::string& word) {
    if (awaited_ != nullptr) {
      awaited_ = nullptr;
    } else if (word == "--") {
      is_other_program_ = true;
    } else if (word.starts_with('-')) {
      const CLI::Option* const option = app_->get_option_no_throw(word);
      if (option != nullptr && option->get_items_expected_max() > 0) awaited_ = option;
    } else if (const CLI::App* const sub = sub_of(word); sub != nullptr) {
      app_ = sub;
      positionals_ = 0;
    } else {
      ++positionals_;
    }
  }

  void complete(const std::string& last) {
    const std::size_t equals = last.find('=');
    if (awaited_ != nullptr) {
      add_values(*awaited_, "", last);
    } else if (last.starts_with("--") && equals != last.npos) {
      const CLI::Option* const option = app_->get_option_no_throw(last.substr(0, equals));
      if (option != nullptr) {
        add_values(*option, last.substr(0, equals + 1), last.substr(equals + 1));
      }
    } else if (last.starts_with('-')) {
      for (const CLI::Option* const option : app_->get_options()) add_names(*option, last);
    } else {
      for (const CLI::App* const sub : app_->get_subcommands({})) {
        if (!sub->get_group().empty()) add(last, sub->get_name(), sub->get_description());
      }
      if (const CLI::Option* const option = positional(); option != nullptr) {
        add_values(*option, "", last);
      }
    }
  }

  const CLI::App* sub_of(const std::string& word) const {
    for (const CLI::App* const sub : app_->get_subcommands({})) {
      if (sub->check_name(word)) return sub;
    }
    return nullptr;
  }

  /// The one that is next; the last one may be there several times.
  const CLI::Option* positional() const {
    int before = positionals_;
    for (const CLI::Option* const option : app_->get_options()) {
      if (!option->get_positional()) continue;
      const int most = option->get_items_expected_max();
      if (before < most) return option;
      before -= most;
    }
    return nullptr;
  }

  void add(const std::string& last, const std::string& word, const std::string& what,
           const std::string& prefix = "") {
    if (word.starts_with(last) && !word.empty()) candidates_.push_back({prefix + word, what});
  }

  void add_names(const CLI::Option& option, const std::string& last) {
    if (option.get_group().empty()) return;
    for (const std::string& name : option.get_lnames()) {
      add(last, "--" + name, option.get_description());
    }
    if (last != "-" || !option.get_lnames().empty()) return;
    for (const std::string& name : option.get_snames()) {
      add(last, "-" + name, option.get_description());
    }
  }

  /// prefix: "--executor=". Of a list, the last part is completed.
  void add_values(const CLI::Option& option, std::string prefix, std::string last) {
    Candidates values = values_in(option.get_type_name());
    bool has_source = !values.empty();
    for (const Source& source : sources()) {
      if (!is_called(option, source.sign) && !says(option, source.sign)) continue;
      has_source = true;
      const std::string text = output_of(source.words);
      const Candidates names =
          source.key != nullptr ? names_in_json(text, source) : names_in_lines(text);
      values.insert(values.end(), names.begin(), names.end());
    }
    const bool may_be_file = !has_source || is_called(option, "FILE");
    if (may_be_file && option.get_type_name() == "TEXT") files_ = files_of(option);
    if (const std::size_t comma = last.rfind(','); comma != last.npos && says(option, "list")) {
      prefix += last.substr(0, comma + 1);
      last.erase(0, comma + 1);
    }
    std::sort(values.begin(), values.end(),
              [](const Candidate& a, const Candidate& b) { return a.word < b.word; });
    std::string before;
    for (const auto& [word, what] : values) {
      if (word != before) add(last, word, what, prefix);
      before = word;
    }
  }

  const CLI::App* app_;
  const CLI::Option* awaited_ = nullptr;  // whose value the next word is
  int positionals_ = 0;                   // that have passed
  bool is_other_program_ = false;
  Candidates candidates_;
  std::string files_;
};

void set_up(CLI::App* command) {
  command->group("");  // for the completion of shells, not for people
  command->set_help_flag();
  command->prefix_command();
  command->callback([command] {
    std::vector<std::string> words = command->remaining();
    if (!words.empty()) words.erase(words.begin());  // "takt"
    Completion(command->get_parent(), words).print();
  });
}
const Command registered("complete", "Completes a command line, for shells", set_up);

}  // namespace
}  // namespace takt::tools::complete_command
