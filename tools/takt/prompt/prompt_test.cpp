// What all commands have in common at the prompt: help, examples, defaults, and answers to
// mistakes.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <memory>
#include <regex>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

#include "commands.hpp"
#include "prompt/mistakes.hpp"

namespace takt::tools {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Words = std::vector<std::string>;

void for_each(CLI::App& app, const std::function<void(CLI::App&)>& visit) {
  if (app.get_group().empty()) return;  // hidden: for programs
  visit(app);
  for (CLI::App* const each : app.get_subcommands({})) for_each(*each, visit);
}

/// Thrown where a command would begin.
struct Begins {};

std::unique_ptr<CLI::App> make_takt() {
  auto app = std::make_unique<CLI::App>("Takt", "takt");
  set_up(*app);
  app->parse_complete_callback([] { throw Begins(); });
  return app;
}

/// What `takt` says of these words; empty: they are right.
std::string said(const Words& words) {
  const auto app = make_takt();
  Words reversed(words.rbegin(), words.rend());  // as CLI11 wants them
  try {
    app->parse(reversed);
  } catch (const Begins&) {
    return "";
  } catch (const CLI::ParseError& error) {
    return mistake(*app, error, words);
  } catch (const Error& error) {
    return error.what();
  }
  return "it did not begin";
}

/// The words of a line of a shell, up to what ends its first command.
Words words_of(const std::string& line) {
  static const std::regex kEnd("&&| &$|[|>#]|<<| -- ");
  std::smatch end;
  const std::string first = std::regex_search(line, end, kEnd) ? std::string(end.prefix()) : line;
  Words words;
  std::istringstream parts(first);
  for (std::string part; parts >> part;) {
    while (part.starts_with('\'') && (part.size() == 1 || part.back() != '\'')) {
      std::string more;
      if (!(parts >> more)) break;
      part += " " + more;
    }
    words.push_back(part.starts_with('\'') ? part.substr(1, part.size() - 2) : part);
  }
  return words;
}

Words examples_of(const CLI::App& command) {
  Words examples;
  std::istringstream lines(command.get_footer());
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  takt ")) examples.push_back(line.substr(2));
  }
  return examples;
}

/// One that other programs parse: CLI11 knows nothing of its words.
bool is_of_others(const CLI::App& command) {
  return full_name(command) == "takt ros2 build";
}

// Most commands showed the examples of another one, and nobody had tried them.
TEST(Help, ShowsExamplesOfTheCommandItselfAndTheyParse) {
  const auto app = make_takt();
  for_each(*app, [](CLI::App& command) {
    const Words examples = examples_of(command);
    ASSERT_FALSE(examples.empty()) << full_name(command) << " --help has no example";
    EXPECT_TRUE((examples[0] + " ").starts_with(full_name(command) + " ")) << examples[0];
    for (const std::string& example : examples) {
      Words words = words_of(example);
      words.erase(words.begin());
      EXPECT_EQ(said(words), "") << example;
    }
  });
}

// "(5s)", "default: 5s", "=0.2" and "(default: 5s)" stood side by side.
TEST(Help, WritesADefaultInOneWay) {
  static const std::regex kDefault(R"(.*\(default: [^()]+\))"), kOther(R"(.*\((-?\d[^ ]*|none)\))");
  const auto app = make_takt();
  for_each(*app, [](CLI::App& command) {
    for (const CLI::Option* const option : command.get_options()) {
      const std::string& text = option->get_description();
      const std::string where = full_name(command) + " " + option->get_name() + ": " + text;
      const bool has_default = text.find("default") != text.npos;
      EXPECT_TRUE(!has_default || std::regex_match(text, kDefault)) << where;
      EXPECT_FALSE(std::regex_match(text, kOther)) << where;
      EXPECT_EQ(option->get_default_str(), "") << where;
    }
  });
}

/// One line that says what to do, and nothing of CLI11.
void expect_plain(const std::string& said, const std::string& words) {
  EXPECT_NE(said, "") << words << " is a mistake that takt does not see";
  EXPECT_EQ(said.find('\n'), said.npos) << words;
  EXPECT_THAT(said, HasSubstr("; ")) << words << " does not say what to do";
  static const std::regex kInternal(
      "not in range|is required|TEXT|FLOAT|UINT|\\bINT\\b|ENUM|subcommand|Could not|expected|"
      "e\\+[0-9]{3}|[0-9]{20}|[Aa]t [Mm]ost 1");
  EXPECT_FALSE(std::regex_search(said, kInternal)) << words << ": " << said;
}

/// Words that a command takes: its first example.
Words right_words(const CLI::App& command) {
  Words words = words_of(examples_of(command)[0]);
  words.erase(words.begin());
  return words;
}

// "A subcommand is required" was said of a word that was wrong, and a range had 309 digits.
TEST(Mistakes, AreAnsweredInOnePlainLineByEveryCommand) {
  const auto app = make_takt();
  for_each(*app, [&](CLI::App& command) {
    if (is_of_others(command) || &command == app.get()) return;
    const auto expect = [&](Words words, const std::string& more) {
      words.push_back(more);
      expect_plain(said(words), full_name(command) + " … " + more);
    };
    Words words = right_words(command);
    const bool takes_commands = command.get_require_subcommand_min() > 0;
    if (takes_commands) words.resize(1);  // the name
    if (takes_commands) expect_plain(said(words), full_name(command));
    if (takes_commands) expect(words, "no-such-word");
    if (full_name(command) == "takt ros2 run") return;  // all more is the program's
    expect(words, "--no-such-option");
    for (const CLI::Option* const option : command.get_options()) {
      if (option->get_positional() || option->get_type_size() == 0) continue;
      const std::string type = option->get_type_name(), name = option->get_name();
      if (option->get_expected_min() != 0) expect(words, name);  // without its value
      if (type == "TEXT") continue;
      const bool is_time = type.starts_with("TIME") && name != "--duration";
      for (const char* const wrong : {"nonsense", "-1", is_time ? "5" : "5x", "9e999"}) {
        if (type != "N" || wrong[0] != '-') expect(words, name + "=" + wrong);
      }
    }
  });
}

// More words than a command takes were ignored by some.
TEST(Mistakes, SuperfluousWordsAreOne) {
  const auto app = make_takt();
  for_each(*app, [&](CLI::App& command) {
    bool takes_any = is_of_others(command) || &command == app.get();
    for (const CLI::Option* const option : command.get_options()) {
      takes_any |= option->get_positional() && option->get_expected_max() > 2;
    }
    if (takes_any || command.get_require_subcommand_min() > 0) return;
    Words words = right_words(command);
    words.insert(words.end(), {"more", "and", "more", "words"});
    if (command.get_name() != "rta") expect_plain(said(words), full_name(command) + " more words");
  });
}

struct Case {
  Words words;
  const char* answer;
};

TEST(Mistakes, AreAnsweredWithTheNameThatIsNear) {
  const Case cases[] = {
      {{}, "takt needs a command; one of: action, "},
      {{"runn"}, "takt has no command 'runn'; did you mean 'run'? valid: "},
      {{"--verison"}, "takt has no option '--verison'; did you mean '--version'?"},
      {{"runn", "list"}, "takt has no command 'runn'; did you mean 'run'?"},
      {{"doctor", "--", "/a/program"}, "'/a/program' is one word too many for takt doctor; leave"},
      {{"topic", "list", "--", "a"}, "'a' is one word too many for takt topic list; leave it out"},
      {{"topic", "ecko"}, "takt topic has no command 'ecko'; did you mean 'echo'?"},
      {{"run", "--durtion", "3s", "x.yaml"},
       "takt run has no option '--durtion'; did you mean '--duration'?"},
      {{"run", "a", "b"},
       "'b' is one word too many for takt run; leave it out, or see takt run --help"},
      {{"run", "a", "--composition", "sngle"},
       "--composition: 'sngle' is none of its words; did you mean 'single'?"},
      {{"run", "a", "--duration", "5"}, "--duration: '5' has no unit; write a number and one of"},
      {{"list", "executers"}, "KIND: 'executers' is none of its words; did you mean 'executors'?"},
      {{"check"}, "takt check needs FILE; see takt check --help"},
      {{"compare", "a", "--repeat", "0"},
       "--repeat: '0' is not a whole number from 1 to 1000; see "},
      {{"node", "list", "--domain", "abc"},
       "--domain: 'abc' is not a whole number; see takt node "},
      {{"run", "a", "--executor"}, "--executor needs a value; see takt run --help"},
      {{"run", "a", "--json", "a", "--json", "b"}, "--json is given more than once; see takt run"},
      {{"run", "a", "--load", "any"},
       "--load is for --name only; give --name, or leave --load out"},
      {{"latency", "-l5", "-D5"}, "cannot be given with"},
      {{"run", "a", "--histograms=1"}, "--histograms takes no value; write --histograms"},
      {{"latency", "-q=1"}, "-q takes no value; write -q"},
      {{"graph", "a", "-o", ""}, "its value is empty; write one, or leave it out"},
      {{"run", "a", "--json="}, "--json needs a value; see takt run --help"},
      {{"latency", "--early-wake", "50"}, "--early-wake: '50' has no unit; write"},
  };
  for (const Case& each : cases) EXPECT_THAT(said(each.words), HasSubstr(each.answer));
  for (const Words& words : {Words{}, Words{"runn"}}) {
    EXPECT_THAT(said(words), Not(HasSubstr("complete"))) << "it is for shells";
  }
  for (const char* const right : {"5", "5s", "2m"}) EXPECT_EQ(said({"latency", "-D", right}), "");
}

}  // namespace
}  // namespace takt::tools
