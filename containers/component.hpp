// Nodes that a container makes by name.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_COMPONENT_HPP_
#define TAKT_CONTAINERS_COMPONENT_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/base/registry.hpp"
#include "takt/base/version.hpp"
#include "takt/nodes/node.hpp"

namespace takt {

/// A component as its container holds it: whatever it is, it has a node.
struct Component {
  std::shared_ptr<Node> node;
};

/// For a component whose work is done only when something is completed after its last callback: a
/// file that has to be written to its end. A node derives from it too.
class Completing {
 public:
  virtual ~Completing() = default;
  /// Called once, when no callback of the node runs any more. Returns why the work is not done, in
  /// one line; then `takt run` exits with 1. Empty: all is well.
  virtual std::string complete() = 0;
};

using ComponentRegistry = Registry<Component, NoTraits, const NodeOptions&>;
extern template class Registry<Component, NoTraits, const NodeOptions&>;
/// All component classes of this process by name.
ComponentRegistry& components();

/// A class that the component index knows.
struct IndexedComponent {
  std::string name;     // "demo::Lidar"
  std::string library;  // the file that registers it
};

/// The component index: files in `share/takt/components` of the prefixes in the environment
/// variable TAKT_COMPONENT_PATH (separated by ':'), and of the one that Takt itself lies in; then
/// those of ROS 2, in `share/ament_index/resource_index/rclcpp_components` of the prefixes in
/// AMENT_PREFIX_PATH. Of two classes with one name, the first. `takt_add_component` of CMake writes
/// the files, one for each library, with lines `demo::Lidar;lib/libdemo.so`, the library being
/// relative to the prefix.
/// Throws Error with file and line when one cannot be understood.
std::vector<IndexedComponent> component_index();

/// Makes sure that `components()` has the class: it is there, or in `library` (as for dlopen), or,
/// without one, in the library that the index tells. A library brings all its classes, and is never
/// unloaded. Throws Error when it cannot be loaded, was built against another Takt, registers
/// nothing or not that class, or when another library has registered one of its classes; then
/// nothing is added.
/// Thread safety: from any thread.
/// Real-time: no.
void find_component(const std::string& name, const std::string& library = {});

/// Adds to `components()`; while a library is loaded, only notes it for find_component(). For the
/// macro below. Always true.
bool register_component(std::string name, std::string description, ComponentRegistry::Factory make,
                        const char* version);

/// At global scope in a .cpp file: makes `Class`, a Node whose constructor takes
/// `const NodeOptions&`, known by its name as written ("demo::Lidar"). A description of one line,
/// for lists, may follow: TAKT_REGISTER_COMPONENT(demo::Lidar, "looks around").
#define TAKT_REGISTER_COMPONENT(Class, ...)                                              \
  namespace {                                                                            \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_component_) = ::takt::register_component( \
      #Class, ::std::string(__VA_ARGS__),                                                \
      [](const ::takt::NodeOptions& options) {                                           \
        return std::make_unique<::takt::Component>(                                      \
            ::takt::Component{std::make_shared<Class>(options)});                        \
      },                                                                                 \
      TAKT_VERSION);                                                                     \
  }

}  // namespace takt

#endif  // TAKT_CONTAINERS_COMPONENT_HPP_
