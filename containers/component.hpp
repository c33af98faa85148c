// Components: node classes that a container constructs by name.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_COMPONENT_HPP_
#define TAKT_CONTAINERS_COMPONENT_HPP_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/registry.hpp"
#include "takt/base/version.hpp"
#include "takt/base/visibility.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_PUBLIC takt {

/// An instance of a component class, as its container holds it.
struct Component {
  std::shared_ptr<Node> node;
  /// Called once at the end of the container, on its control thread: after all messages are served,
  /// and before the executors end. Stops the threads that the component has started. Must not
  /// throw.
  std::function<void()> on_end = {};
};

/// Interface of a component that must finish some work after its last callback, for example write
/// the end of a file. The component's node class derives from it in addition to Node.
/// Thread safety: the container calls complete() from one thread.
/// Real-time: no.
class Completing {
 public:
  virtual ~Completing() = default;
  /// Called once, after the last callback of the node has returned. Returns an empty string on
  /// success, else the reason in one line; `takt run` then exits with 1.
  virtual std::string complete() = 0;
};

/// What one execution of a callback sends at most.
struct Sending {
  std::size_t messages = 0;
  std::size_t bytes = 0;    // of all messages
  std::size_t written = 0;  // that the callback fills or copies before it sends them
};

/// Interface of a component that knows how long its callbacks run, for the analysis of response
/// times. The component's node class derives from it in addition to Node.
/// Thread safety: as Node. Real-time: no.
class KnowsExecutionTimes {
 public:
  virtual ~KnowsExecutionTimes() = default;
  /// CPU time of each execution of the callback; nullopt: not known. A callback with such a time
  /// never waits, and sends at most one message to each of its topics.
  virtual std::optional<Nanoseconds> execution_time(std::string_view callback) const = 0;
  /// Whether a callback allocates or frees memory, for which it may wait.
  virtual bool uses_heap() const { return true; }
  /// The messages that the callback sends, whose cost is not part of execution_time(). nullopt: not
  /// known.
  virtual std::optional<Sending> sends(std::string_view callback) const {
    static_cast<void>(callback);
    return {};
  }
};

/// Interface of a component that sets the releases of its timers (Timer::release_at), so that their
/// rate does not follow from their periods. The component's node class derives from it in
/// addition to Node. Thread safety: it does nothing. Real-time: it does nothing.
class SetsReleases {
 public:
  virtual ~SetsReleases() = default;
};

using ComponentRegistry = Registry<Component, NoTraits, const NodeOptions&>;
extern template class Registry<Component, NoTraits, const NodeOptions&>;
/// All component classes registered in this process, by name.
ComponentRegistry& components();

/// The names of all components, except those that only commands of `takt` use.
std::vector<std::string> component_names();

/// An entry of the component index.
struct IndexedComponent {
  std::string name;     // "demo::Lidar"
  std::string library;  // the file that registers it
};

/// Reads the component index. It consists of the files in `share/takt/components` of each prefix in
/// the environment variable TAKT_COMPONENT_PATH (separated by ':') and of Takt's own prefix, then
/// of ROS 2's files in `share/ament_index/resource_index/rclcpp_components` of each prefix in
/// AMENT_PREFIX_PATH. If two entries have the same class name, the first one counts. The CMake
/// function `takt_add_component` writes one file per library, with lines like
/// `demo::Lidar;lib/libdemo.so`; the library's path is relative to the prefix.
/// Throws Error with file and line if a file is malformed.
std::vector<IndexedComponent> component_index();

/// Loads the library of a component class, unless the class is registered already. `library` is a
/// name as for dlopen; if it is empty, the component index gives the library. Loading registers all
/// classes of the library; a library is never unloaded. Throws Error, and registers nothing, if the
/// library cannot be loaded, was built against another version of Takt, does not register the
/// class, or registers a class that another library has registered.
/// Thread safety: from any thread.
/// Real-time: no.
void find_component(const std::string& name, const std::string& library = {});

/// Registers a class in `components()`. While find_component() loads a library, it only records the
/// class, so that a library that fails its checks registers nothing. Called by the macro below.
/// Always returns true.
bool register_component(std::string name, std::string description, ComponentRegistry::Factory make,
                        const char* version);

/// Registers the component `Class`, a Node whose constructor takes `const NodeOptions&`, under its
/// name as written here. Use it at global scope in a .cpp file. The optional second argument
/// describes the class in one line, for `takt list`:
/// TAKT_REGISTER_COMPONENT(demo::Lidar, "publishes scans").
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
