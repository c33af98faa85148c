// SPDX-License-Identifier: Apache-2.0
#include "outputs.hpp"

#include <filesystem>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"

#include "commands.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;

std::weak_ptr<Outputs> current;

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code none;
  if (fs::equivalent(a, b, none)) return true;
  // Two that do not exist yet.
  return !fs::exists(a, none) && fs::weakly_canonical(a, none) == fs::weakly_canonical(b, none);
}

void check_file(const Outputs& outputs, const std::string& file, const OutputOption& output) {
  OutputFile::check(file);
  std::error_code none;
  if (fs::exists(file, none) && !fs::is_regular_file(file, none)) return;  // a device, a pipe
  const auto refuse = [&](const std::string& other) {
    throw Error(fmt::format("this file is named twice: by {} and {}, and is not overwritten",
                            output.option->get_name(), other),
                "name another file", file);
  };
  for (const OutputOption& other : outputs.options) {
    const bool is_other = other.command == output.command && other.option != output.option;
    if (!is_other || other.option->empty()) continue;
    for (const std::string& one : other.files(*other.value)) {
      if (is_same_file(one, file)) refuse(other.option->get_name());
    }
  }
  for (const CLI::App* command = output.command; command != nullptr;
       command = command->get_parent()) {
    for (const CLI::Option* option : command->get_options()) {
      if (option == output.option) continue;
      for (const std::string& word : option->results()) {
        if (fs::equivalent(word, file, none)) refuse(option->get_name());
      }
    }
  }
  for (const std::string& word : program_words()) {
    if (fs::equivalent(word, file, none)) refuse("the program");
  }
}

void check(const Outputs& outputs) {
  for (const OutputOption& output : outputs.options) {
    if (output.command != outputs.chosen || output.option->empty()) continue;
    for (const std::string& file : output.files(*output.value)) check_file(outputs, file, output);
  }
}

}  // namespace

std::vector<std::string> named_file(const std::string& value) {
  if (value.empty() || value == "-") return {};
  return {value};
}

CLI::Option* add_output(CLI::App& command, const std::string& names, std::string& value,
                        const std::string& what, FilesOf files) {
  CLI::Option* const option = command.add_option(names, value, what);
  current.lock()->options.push_back({&command, option, &value, std::move(files)});
  if (command.get_option_no_throw("--force") == nullptr) {
    command.add_flag_callback(
        "--force", [] { OutputFile::permit_overwriting(); },
        "Overwrite a file that takt did not write, too; never one that this command reads");
  }
  return option;
}

std::shared_ptr<Outputs> begin_outputs() {
  const auto outputs = std::make_shared<Outputs>();
  current = outputs;
  return outputs;
}

void check_outputs_of(CLI::App& app, const std::shared_ptr<Outputs>& outputs) {
  for (CLI::App* const command : app.get_subcommands({})) {
    check_outputs_of(*command, outputs);
    command->parse_complete_callback([command, outputs] {
      outputs->chosen = command;
      check(*outputs);
    });
  }
}

void check_chosen_outputs() {
  if (const auto outputs = current.lock()) check(*outputs);
}

}  // namespace takt::tools
