// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "takt/base/file_place.hpp"
#include "takt/containers/configuration/keys/readers.hpp"

namespace takt {

void ContainerReader::read_containers(const Value& value) {
  std::map<std::string, int> lines;
  each_in_list([&](const Value& container) {
    const std::string name = read_container(container);
    if (lines.empty()) system_.name = name;
    const auto [known, is_new] = lines.try_emplace(name, container.line);
    if (is_new) return;
    errors_.add(container.line,
                fmt::format("the container in line {} has the name '{}', too", known->second, name),
                "give each container its own 'name'");
  })(value);
  if (lines.empty() && std::holds_alternative<document::List>(value.content)) {
    errors_.add(value.line, "the list of containers is empty", "add a container");
  }
}

void ContainerReader::check(const Value& root) {
  check_number_of_containers(root);
  check_that_loading_can_be_asked_for(root);
  if (system_.watches_bounds)
    check_that_one_process_runs(root, *document::find(*document::find(root, "analysis"), "watch"));
  if (!system_.modes.empty()) check_that_one_process_runs(root, *document::find(root, "modes"));
}

void ContainerReader::check_number_of_containers(const Value& root) {
  if (!std::holds_alternative<document::Map>(root.content)) return;
  const Value* one = document::find(root, "container");
  const Value* several = document::find(root, "containers");
  if (const Value* nodes = document::find(root, "nodes")) {
    check_file_of_program(root, *nodes);
  } else if (one == nullptr && several == nullptr) {
    errors_.add(root.line, "the file describes no container",
                "add the key 'containers' with a list of components");
  } else if (one != nullptr && several != nullptr) {
    errors_.add(std::max(one->line, several->line),
                "the file has both 'container' and 'containers'", "remove one of them");
  }
}

// A program makes its nodes, and decides everything that these keys would set.
void ContainerReader::check_file_of_program(const Value& root, const Value& nodes) {
  for (const std::string_view key :
       {"container", "containers", "dds", "topics", "lifecycle", "model", "priorities"}) {
    if (const Value* other = document::find(root, key)) {
      errors_.add(other->line,
                  fmt::format("'{}' has no place in a file with 'nodes', for a program", key),
                  "remove one of them");
    }
  }
  const auto* map = std::get_if<document::Map>(&nodes.content);
  if (map != nullptr && map->values.empty()) {
    errors_.add(nodes.line, "the map of nodes is empty", "add at least one of the program's nodes");
  }
}

void ContainerReader::check_that_loading_can_be_asked_for(const Value& root) {
  const Value* only = document::find(root, "container");
  if (const Value* several = document::find(root, "containers")) {
    const auto* list = std::get_if<document::List>(&several->content);
    only = list != nullptr && list->size() == 1 ? &list->front() : nullptr;
  }
  const Value* load = only != nullptr ? document::find(*only, "load") : nullptr;
  if (load == nullptr || document::find(root, "dds") != nullptr) return;
  errors_.add(load->line, "a container receives load requests over DDS, which this file lacks",
              "remove 'load', or add the key 'dds'");
}

std::string ContainerReader::read_container(const Value& value) {
  const std::size_t before = system_.components.size();
  const Value* place = document::find(value, "components");
  std::string name = "takt";
  RestartOptions restart;
  LoadPolicy load;
  read_map(
      value, "a container",
      {{"name", "Also the name of its process in results.", into(name)},
       {"restart", "When `takt run` restarts its process.", into_restart(restart)},
       {"load",
        "Which libraries it may load at run time, on request of `takt component load` or ROS 2; "
        "by default `index`, but nothing if it runs as root, or with capabilities other than "
        "CAP_SYS_NICE and CAP_IPC_LOCK, and without DDS Security. "
        "`off`: none, and no component of a loaded library either. `index`: those in the component "
        "index and in the keys `library` of this file. `any`: every file, on request of any "
        "process on the domain. See [security](../explanation/security.md).",
        into_load(load)},
       {"components", "At least one.",
        each_in_list([this](const Value& item) { ComponentReader(file_).read_component(item); }),
        true}});
  if (place != nullptr && std::holds_alternative<document::List>(place->content) &&
      system_.components.size() == before) {
    errors_.add(place->line, fmt::format("the container '{}' is empty", name),
                "list at least one component");
  }
  for (std::size_t i = before; i < system_.components.size(); ++i) {
    system_.components[i].container = name;
  }
  if (restart.policy != RestartOptions::Policy::never) system_.restarts[name] = restart;
  load.is_given = document::find(value, "load") != nullptr;
  system_.loads[name] = load;
  return name;
}

// The key needs the whole system: each of several processes would know only its own part, and a
// program may have more than the file.
void ContainerReader::check_that_one_process_runs(const Value& root, const Value& value) {
  const auto refuse = [&](const std::string& why) {
    errors_.add(value.line, fmt::format("`{}` is for a file with one process: {}", value.name, why),
                "leave it out");
  };
  if (document::find(root, "nodes") != nullptr) refuse("this one is for a program");
  std::set<std::string> containers;
  for (const ComponentDescription& component : system_.components) {
    containers.insert(component.container);
  }
  if (containers.size() > 1) refuse(fmt::format("there are {}", containers.size()));
}

SystemReader::Read ContainerReader::into_load(LoadPolicy& load) {
  const Read word = into(load.kind, {{"off", LoadPolicy::Kind::off},
                                     {"index", LoadPolicy::Kind::index},
                                     {"any", LoadPolicy::Kind::any}});
  return either(word, [this, &load](const Value& value) {
    read_map(
        value, "a load policy",
        {{"libraries",
          "Folders, with their subfolders, from which libraries may be loaded in addition to "
          "`index`. Only their owner and group may be able to change them, their subfolders and "
          "the "
          "libraries. Relative paths start at the folder of this file.",
          each_in_list([this, &load](const Value& folder) { read_folder(folder, load); })},
         {"recordings",
          "The folder beneath which components that are loaded on request may read and write "
          "files: `takt::Recorder` writes new ones, `takt::Player` reads. It belongs to the user "
          "of the container. By default, they may use no files.",
          into_checked(load.recordings, [this, &load] {
            check_own_folder(beside(load.recordings));
            load.recordings = std::filesystem::canonical(beside(load.recordings));
          })}});
    const Value* libraries = document::find(value, "libraries");
    if (libraries == nullptr && document::find(value, "recordings") == nullptr) {
      errors_.add(value.line, "a load policy needs 'libraries' or 'recordings'", "add one");
    }
    if (document::is_empty_list(libraries)) {
      errors_.add(libraries->line, "the list of folders is empty",
                  "name a folder, or write `load: index`");
    }
  });
}

void ContainerReader::read_folder(const Value& value, LoadPolicy& load) {
  std::string folder;
  into_checked(folder, [&] { load.folders.push_back(real_folder(beside(folder))); })(value);
}

SystemReader::Read ContainerReader::into_restart(RestartOptions& restart) {
  const Read policy = into(restart.policy, {{"never", RestartOptions::Policy::never},
                                            {"on_failure", RestartOptions::Policy::on_failure},
                                            {"always", RestartOptions::Policy::always}});
  return either(policy, [this, policy, &restart](const Value& value) {
    read_map(value, "a restart",
             {{"policy", "Never, after a failure, or always.", policy, true},
              {"delay", "Time between end and restart.", into_duration(restart.delay, [] {})},
              {"most", "Maximum number of restarts in one run.", into(restart.most, 1)}});
  });
}

}  // namespace takt
