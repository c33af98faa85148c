// takt list: lists everything that is chosen by name.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/measuring/output.hpp"

#include "catalogue/catalogue.hpp"
#include "commands.hpp"
#include "prompt/values.hpp"

namespace takt::tools::list_command {
namespace {

template <class AnyRegistry>
void print(const AnyRegistry& registry, const std::vector<std::string>& names) {
  std::size_t width = 0;
  for (const std::string& name : names) width = std::max(width, name.size());
  for (const std::string& name : names) {
    rt::print("{:<{}}  {}\n", name, width, registry.description(name));
    if constexpr (requires { registry.traits(name).keys; }) {
      for (const OwnKey& key : registry.traits(name).keys) {
        rt::print("{:<{}}    its key `{}`: {}\n", "", width, key.name, key.help);
      }
    }
  }
}

void print_catalogue() {
  std::size_t width = 0;
  for (const CatalogueEntry& entry : catalogue()) width = std::max(width, entry.word.size());
  for (const CatalogueEntry& entry : catalogue()) {
    rt::print("{:<{}}  {}{}\n", entry.word, width, entry.idea,
              entry.why_not.empty() ? "" : fmt::format("; fits no other file: {}", entry.why_not));
  }
}

// Construct each back end to find out whether this kernel supports it.
void print_wait_backends() {
  const WaitBackendRegistry& registry = wait_backends();
  for (const std::string& name : registry.names()) {
    std::string granted = "granted";
    try {
      registry.make(name, 1);
    } catch (const Error& error) {
      granted = fmt::format("refused: {}", error.what());
    }
    rt::print("{:<8}  {}; {}\n", name, registry.description(name), granted);
  }
}

void set_up(CLI::App* command) {
  const auto kind = std::make_shared<std::string>();
  one_of(
      command
          ->add_option("KIND", *kind,
                       "executors, schedulers, wait_backends, transports, components or catalogue")
          ->required(),
      {"executors", "schedulers", "wait_backends", "transports", "components", "catalogue"});
  const auto file = std::make_shared<std::string>();
  command->add_option("FILE", *file,
                      "A configuration file: also lists what the libraries that it names register");
  command->footer("Example:\n  takt list executors\n  takt list schedulers robot.yaml\n");
  command->callback([kind, file] {
    if (!file->empty()) read_system(*file);  // it loads them
    if (*kind == "executors") print(executors(), executors().names());
    if (*kind == "schedulers") print(schedulers(), schedulers().names());
    if (*kind == "wait_backends") print_wait_backends();
    if (*kind == "components") {
      print(components(), component_names());
      for (const auto& [name, library] : component_index()) rt::print("{}  {}\n", name, library);
    }
    if (*kind == "catalogue") print_catalogue();
    if (*kind == "transports") {
      rt::print(
          "intra  by pointer inside one process\n"
          "dds    through Cyclone DDS, between processes and inside one\n"
          "shm    as dds, but messages of fixed size use shared memory\n");
    }
  });
}
const Command registered("list", "Lists executors, schedulers, components and more", set_up);

}  // namespace
}  // namespace takt::tools::list_command
