// Makes a class of nodes a component, so that containers and programs make nodes by its name.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_COMPONENTS__REGISTER_NODE_MACRO_HPP_
#define RCLCPP_COMPONENTS__REGISTER_NODE_MACRO_HPP_

#include <memory>

#include "takt/base/registry.hpp"
#include "takt/base/version.hpp"
#include "takt/containers/component.hpp"

#include "rclcpp_components/node_factory_template.hpp"

// With the source of class_loader in the workspace, class_loader finds the component, too.
#if __has_include("class_loader/register_macro.hpp")
#include "class_loader/register_macro.hpp"
#define TAKT_RCLCPP_CLASS_LOADER_(NodeClass)                                       \
  CLASS_LOADER_REGISTER_CLASS(::rclcpp_components::NodeFactoryTemplate<NodeClass>, \
                              ::rclcpp_components::NodeFactory)
#else
#define TAKT_RCLCPP_CLASS_LOADER_(NodeClass)
#endif

namespace rclcpp_components::detail {

/// For Takt's containers: makes the user's node and returns the Takt node inside, which keeps the
/// user's node alive.
std::unique_ptr<takt::Component> component_of(NodeFactory& factory,
                                              const takt::NodeOptions& options);

template <class NodeT>
bool register_node(const char* name) {
  static const auto factory = std::make_shared<NodeFactoryTemplate<NodeT>>();
  takt::register_component(
      name, "", [](const takt::NodeOptions& options) { return component_of(*factory, options); },
      TAKT_VERSION);
  return register_factory(name, factory, &factory);
}

}  // namespace rclcpp_components::detail

/// Use at global scope; `NodeClass` is the full name of the class.
#define RCLCPP_COMPONENTS_REGISTER_NODE(NodeClass)                       \
  namespace {                                                            \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_rclcpp_component_) =      \
      ::rclcpp_components::detail::register_node<NodeClass>(#NodeClass); \
  }                                                                      \
  TAKT_RCLCPP_CLASS_LOADER_(NodeClass)

#endif  // RCLCPP_COMPONENTS__REGISTER_NODE_MACRO_HPP_
