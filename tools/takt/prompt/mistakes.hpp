// One line for each mistake in the words of a command: what is wrong; what to do.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_MISTAKES_HPP_
#define TAKT_TOOLS_TAKT_MISTAKES_HPP_

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace takt::tools {

/// Names of all subcommands that are for people.
std::vector<std::string> commands_of(const CLI::App& command);
/// "takt topic echo".
std::string full_name(const CLI::App& command);
/// What the error of CLI11 about the words is, in words of our own: it knows neither which command
/// was meant nor which name is near.
std::string mistake(const CLI::App& app, const CLI::ParseError& error,
                    const std::vector<std::string>& words);

/// Help without the type names and notes of CLI11.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_MISTAKES_HPP_
