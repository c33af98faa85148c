// takt list: what can be chosen by name.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "commands.hpp"
#include "takt/containers/component.hpp"
#include "takt/executors/executor.hpp"

namespace takt::tools {
namespace {

template <class AnyRegistry>
void print(const AnyRegistry& registry) {
  std::size_t width = 0;
  for (const std::string& name : registry.names()) width = std::max(width, name.size());
  for (const std::string& name : registry.names()) {
    fmt::print("{:<{}}  {}\n", name, width, registry.description(name));
  }
}

}  // namespace

void add_list(CLI::App& app) {
  CLI::App* command = app.add_subcommand("list", "What can be chosen by name, one a line");
  const auto kind = std::make_shared<std::string>();
  command->add_option("KIND", *kind, "executors, schedulers, transports or components")
      ->required()
      ->check(CLI::IsMember({"executors", "schedulers", "transports", "components"}));
  command->footer("Example:\n  takt list executors\n");
  command->callback([kind] {
    if (*kind == "executors") print(executors());
    if (*kind == "schedulers") print(schedulers());
    if (*kind == "components") print(components());
    if (*kind == "transports") fmt::print("intra  by pointer inside one process\n");
  });
}

}  // namespace takt::tools
