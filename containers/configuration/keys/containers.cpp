// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/containers/configuration/configuration_reader.hpp"

namespace takt {

void ConfigurationReader::read_containers(const Value& value) {
  std::map<std::string, int> lines;
  each_in_list([&](const Value& container) {
    const std::string name = read_container(container);
    if (lines.empty()) system_.name = name;
    const auto [known, is_new] = lines.try_emplace(name, container.line);
    if (is_new) return;
    errors_.add(container.line,
                fmt::format("the container of line {} is called '{}' too", known->second, name),
                "give each its own 'name'");
  })(value);
  if (lines.empty() && std::holds_alternative<document::List>(value.content)) {
    errors_.add(value.line, "the list of containers is empty", "describe one");
  }
}

void ConfigurationReader::check_number_of_containers(const Value& root) {
  if (!std::holds_alternative<document::Map>(root.content)) return;
  const Value* one = document::find(root, "container");
  const Value* several = document::find(root, "containers");
  if (one == nullptr && several == nullptr) {
    errors_.add(root.line, "the file describes no container",
                "add the key 'containers' with a list of components");
  } else if (one != nullptr && several != nullptr) {
    errors_.add(std::max(one->line, several->line),
                "the file has both 'container' and 'containers'", "leave out one of the two");
  }
}

void ConfigurationReader::check_that_loading_can_be_asked_for(const Value& root) {
  const Value* only = document::find(root, "container");
  if (const Value* several = document::find(root, "containers")) {
    const auto* list = std::get_if<document::List>(&several->content);
    only = list != nullptr && list->size() == 1 ? &list->front() : nullptr;
  }
  const Value* load = only != nullptr ? document::find(*only, "load") : nullptr;
  if (load == nullptr || document::find(root, "dds") != nullptr) return;
  errors_.add(load->line, "nobody can ask a container to load anything that is not on DDS",
              "leave out 'load', or add the key 'dds'");
}

std::string ConfigurationReader::read_container(const Value& value) {
  const std::size_t before = system_.components.size();
  const Value* place = document::find(value, "components");
  std::string name = "takt";
  RestartOptions restart;
  LoadPolicy load;
  read_map(
      value, "a container",
      {{"name", "The process in results.", into(name)},
       {"restart", "When its process is started again after its end.", into_restart(restart)},
       {"load",
        "Which libraries it loads when it is asked to while it runs, by `takt component load` or "
        "ROS 2. `off`: none, and no component either. `index`: those that the component index "
        "and the keys `library` of this file name. `any`: every file, for everybody on the "
        "domain. See [security](../explanation/security.md).",
        into_load(load)},
       {"components", "Not empty.",
        each_in_list([this](const Value& item) { read_component(item); }), true}});
  if (place != nullptr && std::holds_alternative<document::List>(place->content) &&
      system_.components.size() == before) {
    errors_.add(place->line, fmt::format("the container '{}' is empty", name),
                "list at least one component");
  }
  for (std::size_t i = before; i < system_.components.size(); ++i) {
    system_.components[i].container = name;
  }
  if (restart.policy != RestartOptions::Policy::never) system_.restarts[name] = restart;
  system_.loads[name] = load;
  return name;
}

SystemReader::Read ConfigurationReader::into_load(LoadPolicy& load) {
  const Read word = into(load.kind, {{"off", LoadPolicy::Kind::off},
                                     {"index", LoadPolicy::Kind::index},
                                     {"any", LoadPolicy::Kind::any}});
  return either(word, [this, &load](const Value& value) {
    read_map(
        value, "a load policy",
        {{"libraries",
          "Folders: with `index`, the libraries in them and below. A relative path begins "
          "in the folder of this file.",
          each_in_list([this, &load](const Value& folder) { read_folder(folder, load); }), true}});
    const Value* libraries = document::find(value, "libraries");
    if (document::is_empty_list(libraries)) {
      errors_.add(libraries->line, "the list of folders is empty",
                  "name a folder, or write `load: index`");
    }
  });
}

void ConfigurationReader::read_folder(const Value& value, LoadPolicy& load) {
  std::string folder;
  into_checked(folder, [&] { load.folders.push_back(real_folder(beside(folder))); })(value);
}

SystemReader::Read ConfigurationReader::into_restart(RestartOptions& restart) {
  const Read policy = into(restart.policy, {{"never", RestartOptions::Policy::never},
                                            {"on_failure", RestartOptions::Policy::on_failure},
                                            {"always", RestartOptions::Policy::always}});
  return either(policy, [this, policy, &restart](const Value& value) {
    read_map(value, "a restart",
             {{"policy", "Never, after a failure, or after every end.", policy, true},
              {"delay", "How long after the end.", into_duration(restart.delay, [] {})},
              {"most", "How often in one run.", into(restart.most, 1)}});
  });
}

}  // namespace takt
