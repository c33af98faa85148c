// Factories of node classes, and the classes that libraries have registered.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_COMPONENTS__NODE_FACTORY_HPP_
#define RCLCPP_COMPONENTS__NODE_FACTORY_HPP_

#include <memory>
#include <string>
#include <vector>

#include "rclcpp/node_options.hpp"
#include "rclcpp_components/node_instance_wrapper.hpp"

namespace rclcpp_components {

/// Thread safety: from any thread. Real-time: set-up only.
class NodeFactory {
 public:
  virtual ~NodeFactory() = default;
  virtual NodeInstanceWrapper create_node_instance(const rclcpp::NodeOptions& options) = 0;
};

// For this library and programs that its CMake functions make.

namespace detail {

struct RegisteredFactory {
  std::string name;     // "demo::Talker"
  std::string library;  // the file with its code, as the loader names it
  std::shared_ptr<NodeFactory> factory;
};

/// Registers the factory of a class. `code`: any address in the library of the class. Always
/// returns true.
bool register_factory(const char* name, std::shared_ptr<NodeFactory> factory, const void* code);
std::vector<RegisteredFactory> registered_factories();

/// Loads a library. False: `error` says why. `file`: the path as the dynamic loader has it; "" for
/// the program itself.
bool open_library(const std::string& path, std::string& file, std::string& error);

/// Throws takt::Error if no loaded library has registered the class.
NodeInstanceWrapper make_node(const std::string& name, const rclcpp::NodeOptions& options);

}  // namespace detail
}  // namespace rclcpp_components

#endif  // RCLCPP_COMPONENTS__NODE_FACTORY_HPP_
