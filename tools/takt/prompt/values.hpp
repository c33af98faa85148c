// What the value of an option may be. Refusals say in plain words what to write instead.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_VALUES_HPP_
#define TAKT_TOOLS_TAKT_VALUES_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/base/time.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace takt::tools {

/// One of these words: --help shows them as `a|b|c`.
CLI::Option* one_of(CLI::Option* option, const std::vector<std::string>& words);
/// A whole number from `least` to `most`.
CLI::Option* whole_number(CLI::Option* option, std::int64_t least, std::int64_t most);
/// A number from `least` to `most`.
CLI::Option* number(CLI::Option* option, double least, double most);
/// A number and its unit: see parse_run_time(). `or_word` is permitted instead.
enum class Zero { refused, permitted };
CLI::Option* time_text(CLI::Option* option, const std::string& or_word = {},
                       Zero zero = Zero::refused);

/// Adds a time_text() to a command.
CLI::Option* add_time_option(CLI::App& command, const std::string& names, Nanoseconds& time,
                             const std::string& what, Zero zero = Zero::refused);

/// Adds --placement, of commands that take --executor: file, or merged.
CLI::Option* placement_option(CLI::App* command, std::string& placement);
/// Adds --trace-clock, of commands that record a trace.
CLI::Option* trace_clock_option(CLI::App* command, std::string& clock);

/// A variable that somebody exported long ago changes what runs, and what is analysed: says so.
void note_variables(const std::string& executor, const std::string& placement,
                    const std::string& scheduler);

/// Lets options of all commands that are numbers, and none of the above, say so in the same words;
/// no value is empty.
void finish_values(CLI::App& command);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_VALUES_HPP_
