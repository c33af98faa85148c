// SPDX-License-Identifier: Apache-2.0
#include "prompt/values.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/trace_clock.hpp"
#include "takt/containers/container.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {
namespace {

constexpr const char* kNumber = "N";

template <class T>
std::optional<T> read(const std::string& text) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

template <class T>
CLI::Option* limited(CLI::Option* option, const char* noun, T least, T most) {
  const std::string range = fmt::format("{} from {} to {}", noun, least, most);
  return option->type_name(fmt::format("{}..{}", least, most))
      ->check(CLI::Validator(
          [=](const std::string& text) {
            const std::optional<T> value = read<T>(text);
            if (value && *value >= least && *value <= most) return std::string();
            return fmt::format("'{}' is not {}", text, range);
          },
          ""));
}

/// CLI11 reads -1, and what is too large, as the largest number.
template <class T>
CLI::Option* unlimited(CLI::Option* option, const char* noun) {
  return option->type_name(kNumber)->check(CLI::Validator(
      [noun](const std::string& text) {
        return read<T>(text) ? std::string() : fmt::format("'{}' is not {}", text, noun);
      },
      ""));
}

void not_empty(CLI::Option* option) {
  option->check(CLI::Validator(
      [](const std::string& text) {
        return std::string(text.empty() ? "its value is empty; write one, or leave it out" : "");
      },
      ""));
}

Nanoseconds parse(const std::string& text, Zero zero) {
  return zero == Zero::permitted ? parse_duration(text) : parse_run_time(text);
}

}  // namespace

CLI::Option* one_of(CLI::Option* option, const std::vector<std::string>& words) {
  return option->type_name(fmt::format("{}", fmt::join(words, "|")))
      ->check(CLI::Validator(
          [words](const std::string& text) {
            if (std::find(words.begin(), words.end(), text) != words.end()) return std::string();
            return fmt::format("'{}' is none of its words; {}", text, suggest(text, words));
          },
          ""));
}

CLI::Option* placement_option(CLI::App* command, std::string& placement) {
  return one_of(
      command->add_option(
          "--placement", placement,
          "With an executor type that replaces those of the file. file: each executor "
          "keeps its components, threads and scheduler. merged: one serves all components "
          "of a process, with all their threads (default: file)"),
      placements());
}

CLI::Option* trace_clock_option(CLI::App* command, std::string& clock) {
  return one_of(command->add_option("--trace-clock", clock,
                                    "The clock of the trace's times, to fit those of ftrace, perf "
                                    "or LTTng (default: monotonic)"),
                TraceClock::names());
}

void note_variables(const std::string& executor, const std::string& placement,
                    const std::string& scheduler) {
  const auto note = [](const char* name, const std::string& value) {
    const char* const given = std::getenv(name);
    if (given == nullptr || value.empty() || value != given) return;
    rt::to_stderr("note: {}={} is in force\n", name, printable(value));
  };
  note("TAKT_EXECUTOR", executor);
  note("TAKT_PLACEMENT", placement);
  note("TAKT_SCHEDULER", scheduler);
}

CLI::Option* whole_number(CLI::Option* option, std::int64_t least, std::int64_t most) {
  return limited(option, "a whole number", least, most);
}

CLI::Option* number(CLI::Option* option, double least, double most) {
  return limited(option, "a number", least, most);
}

CLI::Option* time_text(CLI::Option* option, const std::string& or_word, Zero zero) {
  return option->type_name(or_word.empty() ? "TIME" : "TIME|" + or_word)
      ->check(CLI::Validator(
          [or_word, zero](const std::string& text) {
            if (!or_word.empty() && text == or_word) return std::string();
            try {
              parse(text, zero);
            } catch (const Error& error) {
              return std::string(error.what());
            }
            return std::string();
          },
          ""));
}

CLI::Option* add_time_option(CLI::App& command, const std::string& names, Nanoseconds& time,
                             const std::string& what, Zero zero) {
  return time_text(
      command.add_option_function<std::string>(
          names, [&time, zero](const std::string& text) { time = parse(text, zero); }, what),
      {}, zero);
}

void finish_values(CLI::App& command) {
  for (CLI::Option* const option : command.get_options()) {
    if (option->get_items_expected_max() == 0) option->disable_flag_override();  // no --all=x
    if (option->get_items_expected_min() > 0 && !option->get_positional()) not_empty(option);
    const std::string type = option->get_type_name();
    if (type == "UINT") unlimited<std::uint64_t>(option, "a whole number from 0");
    if (type == "INT") unlimited<std::int64_t>(option, "a whole number");
    if (type == "FLOAT") unlimited<double>(option, "a number");
  }
  for (CLI::App* const each : command.get_subcommands({})) finish_values(*each);
}

}  // namespace takt::tools
