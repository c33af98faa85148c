// Nodes that a container makes by name.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_COMPONENT_HPP_
#define TAKT_CONTAINERS_COMPONENT_HPP_

#include <memory>

#include "takt/base/registry.hpp"
#include "takt/entities/node.hpp"

namespace takt {

/// A component as its container holds it: whatever it is, it has a node.
struct Component {
  std::shared_ptr<Node> node;
};

using ComponentRegistry = Registry<Component, const NodeOptions&>;
/// All component classes of this process by name.
ComponentRegistry& components();

// Two steps, because __COUNTER__ must be expanded before it is pasted.
#define TAKT_CONCATENATE(a, b) a##b
#define TAKT_REGISTER_COMPONENT_AS(Class, description, id)                                 \
  namespace {                                                                              \
  [[maybe_unused]] const bool TAKT_CONCATENATE(takt_component_, id) = [] {                 \
    ::takt::components().add(#Class, description, [](const ::takt::NodeOptions& options) { \
      return std::make_unique<::takt::Component>(std::make_shared<Class>(options));        \
    });                                                                                    \
    return true;                                                                           \
  }();                                                                                     \
  }

/// At global scope in a .cpp file: makes `Class`, a Node whose constructor takes
/// `const NodeOptions&`, known by its name as written ("demo::Lidar").
#define TAKT_REGISTER_COMPONENT(Class, description) \
  TAKT_REGISTER_COMPONENT_AS(Class, description, __COUNTER__)

}  // namespace takt

#endif  // TAKT_CONTAINERS_COMPONENT_HPP_
