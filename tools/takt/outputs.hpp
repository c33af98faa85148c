// The options that name a file which a command writes.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_OUTPUTS_HPP_
#define TAKT_TOOLS_TAKT_OUTPUTS_HPP_

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace takt::tools {

/// The files of a value: none for "" and for "-", which is stdout.
using FilesOf = std::function<std::vector<std::string>(const std::string& value)>;
std::vector<std::string> named_file(const std::string& value);

/// Adds such an option, and --force beside it. Before the command begins its work, so that no
/// results are lost, it is refused if one of its files cannot be written, must stay as it is (see
/// OutputFile), or is named twice: as an input, too, or as another output.
CLI::Option* add_output(CLI::App& command, const std::string& names, std::string& value,
                        const std::string& what, FilesOf files = named_file);

/// An option that was added so.
struct OutputOption {
  CLI::App* command;
  CLI::Option* option;
  const std::string* value;
  FilesOf files;
};

/// Those of all commands, and the command whose words are known.
struct Outputs {
  std::vector<OutputOption> options;
  const CLI::App* chosen = nullptr;
};

/// Around the set-up of all commands: from then on, each is checked when its words are known. The
/// commands keep what is returned, so that nothing refers to them once they are destroyed.
std::shared_ptr<Outputs> begin_outputs();
void check_outputs_of(CLI::App& app, const std::shared_ptr<Outputs>& outputs);

/// Once more for the command that was chosen, when it has read its inputs.
void check_chosen_outputs();

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_OUTPUTS_HPP_
