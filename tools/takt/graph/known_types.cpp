// SPDX-License-Identifier: Apache-2.0
#include "graph/known_types.hpp"

#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/components/workload.hpp"

#include "ros_types.hpp"

namespace takt::tools {
namespace {

using Types = std::map<std::string, const MessageType*, std::less<>>;

void add(Types& types, const MessageType& type) {
  types.emplace(type.name, &type);
  for (const MessageField& field : type.fields) {
    if (field.shape.type != nullptr) add(types, *field.shape.type);
  }
}

const Types& types() {
  static const Types known = [] {
    Types all;
#define TAKT_ADD(T) add(all, message_type<::T>());
    TAKT_ROS_TYPES(TAKT_ADD)
#undef TAKT_ADD
    add(all, message_type<WorkloadMessage>());
    add(all, message_type<WorkloadService::Request>());
    add(all, message_type<WorkloadService::Response>());
    return all;
  }();
  return known;
}

}  // namespace

const MessageType* known_type(std::string_view name) {
  const auto found = types().find(name);
  return found != types().end() ? found->second : nullptr;
}

void throw_unknown_type(std::string_view name) {
  std::set<std::string> packages;
  std::vector<std::string> of_package;
  const std::string_view package = name.substr(0, name.find('/') + 1);
  for (const auto& [known, type] : types()) {
    packages.insert(known.substr(0, known.find('/')));
    if (known.starts_with(package)) of_package.push_back(known);
  }
  throw Error(
      fmt::format("takt does not know the type {}", name),
      !package.empty() && !of_package.empty()
          ? suggest(name, of_package)
          : fmt::format("it knows those of {}, those below AMENT_PREFIX_PATH, and those that "
                        "a node describes; `hz`, `bw` and `echo --raw` need no type",
                        fmt::join(packages, ", ")));
}

}  // namespace takt::tools
