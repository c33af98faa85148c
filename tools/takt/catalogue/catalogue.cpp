// SPDX-License-Identifier: Apache-2.0
#include "catalogue/catalogue.hpp"

#include <cstdlib>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/containers/configuration/document.hpp"
#include "takt/containers/configuration/replace_executors.hpp"
#include "takt/containers/configuration/system_reader.hpp"

#include "embedded.hpp"

namespace takt::tools {
namespace {

/// The first line of a file, which is a comment.
std::string idea_of(std::string_view text) {
  return std::string(text.substr(2, text.find('\n') - 2));
}

SystemDescription read(const Template& file) {
  document::Errors errors(std::string("catalogue/") + std::string(file.path));
  SystemDescription system =
      read_configuration(document::parse_yaml(std::string(file.text), errors), errors);
  errors.throw_if_any();
  system.file = errors.file();
  return system;
}

std::string word_of(const Template& file) {
  return std::string(file.path.substr(0, file.path.rfind('.')));
}

/// Its component may be in a library that is not here.
std::string why_not(const Template& file) {
  try {
    return why_it_fits_no_other(read(file));
  } catch (const ConfigurationError&) {
    return "its component is one of the examples";
  }
}

SystemDescription read_as(const std::string& as) {
  if (is_file(as)) return read_system(as);
  std::vector<std::string> words;
  for (const Template& file : kCatalogue) {
    words.push_back(word_of(file));
    if (words.back() != as) continue;
    if (const std::string reason = why_not(file); !reason.empty()) throw_unfit(as, reason);
    return read(file);
  }
  throw Error(fmt::format("the catalogue has no '{}'", as),
              fmt::format("{}; or a file, as ./{}.yaml", suggest(as, words), as));
}

}  // namespace

const std::vector<CatalogueEntry>& catalogue() {
  static const std::vector<CatalogueEntry> entries = [] {
    std::vector<CatalogueEntry> all;
    for (const Template& file : kCatalogue)
      all.push_back({word_of(file), idea_of(file.text), why_not(file)});
    return all;
  }();
  return entries;
}

SystemDescription read_system_as(const std::string& path, const std::string& as,
                                 const Settings& settings) {
  SystemDescription system = read_system(path, settings);
  if (as.empty()) return system;
  return replace_executors(std::move(system), read_as(as));
}

CLI::Option* as_option(CLI::App& command, std::string& as) {
  // Precedes the environment, as all options do, and that of its children.
  const auto take = [&as](const std::string& word) {
    if (!as.empty()) throw CLI::ArgumentMismatch::AtMost("--as", 1, 2);  // it is taken at once
    as = word;
    for (const char* const other : {"TAKT_EXECUTOR", "TAKT_PLACEMENT", "TAKT_SCHEDULER"})
      unsetenv(other);
  };
  CLI::Option* const option =
      command
          .add_option_function<std::string>(
              "--as", take,
              "Puts all components on the executor of a published paper, with its scheduler and "
              "its way to give priorities (see: takt list catalogue); or on that of another FILE")
          ->trigger_on_parse();
  for (const char* const other : {"--executor", "--placement", "--scheduler"}) {
    if (CLI::Option* const taken = command.get_option_no_throw(other)) option->excludes(taken);
  }
  return option;
}

void name_executor(rt::Run& run, const std::string& as, const std::string& executor,
                   const std::string& placement) {
  run.executor = !as.empty() ? as : !executor.empty() ? executor : "file";
  run.placement = as.empty() ? placement : kAs;
}

}  // namespace takt::tools
