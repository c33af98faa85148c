// One line for each mistake in the words of a command: what is wrong; what to do.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_MISTAKES_HPP_
#define TAKT_TOOLS_TAKT_MISTAKES_HPP_

#include <string>

#include <CLI/CLI.hpp>

namespace takt::tools {

/// Names of all subcommands.
std::vector<std::string> commands_of(const CLI::App& command);
/// "takt topic echo".
std::string full_name(const CLI::App& command);
/// What the error of CLI11 is about, without its words: it knows neither which command was meant
/// nor which name is near.
std::string mistake(const CLI::App& app, const CLI::ParseError& error);

/// Help without the type names and notes of CLI11.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_MISTAKES_HPP_
