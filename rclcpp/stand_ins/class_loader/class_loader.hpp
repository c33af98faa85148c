// A stand-in for class_loader, for programs that load libraries of components by themselves. A
// workspace with the source of class_loader, which loads classes of all kinds, uses that instead.
// SPDX-License-Identifier: Apache-2.0
#ifndef CLASS_LOADER__CLASS_LOADER_HPP_
#define CLASS_LOADER__CLASS_LOADER_HPP_

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "rclcpp_components/node_factory.hpp"

namespace class_loader {

struct LibraryLoadException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct CreateClassException : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One library, which stays loaded. Its classes are those of RCLCPP_COMPONENTS_REGISTER_NODE;
/// others do not compile. Thread safety: from any thread. Real-time: set-up only.
class ClassLoader {
 public:
  /// "" is the program itself, with all that it links.
  explicit ClassLoader(const std::string& library_path, bool /*ondemand_load_unload*/ = false)
      : path_(library_path) {
    std::string error;
    if (!rclcpp_components::detail::open_library(path_, file_, error)) {
      throw LibraryLoadException("Could not load library: " + error);
    }
  }

  std::string getLibraryPath() const { return path_; }
  bool isLibraryLoaded() const { return true; }

  template <class Base>
  std::vector<std::string> getAvailableClasses() const {
    check<Base>();
    std::vector<std::string> names;
    for (const auto& one : factories()) names.push_back(one.name);
    return names;
  }
  template <class Base>
  bool isClassAvailable(const std::string& name) const {
    check<Base>();
    for (const auto& one : factories()) {
      if (one.name == name) return true;
    }
    return false;
  }
  template <class Base>
  std::shared_ptr<Base> createInstance(const std::string& name) {
    check<Base>();
    for (const auto& one : factories()) {
      if (one.name == name) return one.factory;
    }
    throw CreateClassException("the library '" + path_ + "' has registered no component " + name);
  }
  template <class Base>
  std::shared_ptr<Base> createSharedInstance(const std::string& name) {
    return createInstance<Base>(name);
  }

 private:
  template <class Base>
  static void check() {
    static_assert(std::is_same_v<Base, rclcpp_components::NodeFactory>,
                  "This class_loader loads components only; with its source, "
                  "https://github.com/ros/class_loader, "
                  "in the workspace it loads all classes: see docs/reference/rclcpp_build.md");
  }
  std::vector<rclcpp_components::detail::RegisteredFactory> factories() const {
    auto all = rclcpp_components::detail::registered_factories();
    std::erase_if(all, [&](const auto& one) { return !file_.empty() && one.library != file_; });
    return all;
  }

  std::string path_;
  std::string file_;  // as the dynamic loader has it; "" for the program
};

}  // namespace class_loader

#endif  // CLASS_LOADER__CLASS_LOADER_HPP_
