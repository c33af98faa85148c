// The executors of the literature, each as a file that runs: examples/catalogue.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CATALOGUE_HPP_
#define TAKT_TOOLS_TAKT_CATALOGUE_HPP_

#include <string>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/measuring/run.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace takt::tools {

struct CatalogueEntry {
  std::string word, idea;
  std::string why_not;  // it fits no other file; empty: it does
};
/// In the order of their words.
const std::vector<CatalogueEntry>& catalogue();

/// Whether such a word is a file of a user.
inline bool is_file(const std::string& as) {
  return as.find('/') != as.npos || as.ends_with(".yaml");
}

/// The file's system; under the executors of an entry, or of another file, unless `as` is empty.
/// Throws Error if there is no such entry, or it fits no other file.
SystemDescription read_system_as(const std::string& path, const std::string& as,
                                 const Settings& settings = {});

/// Adds --as, of commands that take --executor. Call it after the options of that.
CLI::Option* as_option(CLI::App& command, std::string& as);

/// The placement of --as in results.
inline constexpr const char* kAs = "as";
/// Says in results what chose the executors: --as, --executor, or, if they are empty, the file.
void name_executor(rt::Run& run, const std::string& as, const std::string& executor,
                   const std::string& placement);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CATALOGUE_HPP_
