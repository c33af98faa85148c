// A selection of the interfaces of a node of any class.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_INTERFACES_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_INTERFACES_HPP_

#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>

#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/node_interfaces/node_clock_interface.hpp"
#include "rclcpp/node_interfaces/node_graph_interface.hpp"
#include "rclcpp/node_interfaces/node_logging_interface.hpp"
#include "rclcpp/node_interfaces/node_parameters_interface.hpp"
#include "rclcpp/node_interfaces/node_services_interface.hpp"
#include "rclcpp/node_interfaces/node_time_source_interface.hpp"
#include "rclcpp/node_interfaces/node_timers_interface.hpp"
#include "rclcpp/node_interfaces/node_topics_interface.hpp"
#include "rclcpp/node_interfaces/node_type_descriptions_interface.hpp"
#include "rclcpp/node_interfaces/node_waitables_interface.hpp"

namespace rclcpp {
namespace detail {
/// A node by pointer, smart pointer or reference.
template <class N>
decltype(auto) dereferenced(N&& node) {
  if constexpr (requires { *node; }) {
    return *node;
  } else {
    return (node);
  }
}
}  // namespace detail

namespace node_interfaces {

/// `get_node_base_interface(node)` and so on: from a node by pointer or reference, or from the
/// interface itself.
#define RCLCPP_GET_INTERFACE_(Type, get)                             \
  template <class N>                                                 \
  std::shared_ptr<Type> get(N&& node) {                              \
    if constexpr (std::is_convertible_v<N, std::shared_ptr<Type>>) { \
      return node;                                                   \
    } else {                                                         \
      return ::rclcpp::detail::dereferenced(node).get();             \
    }                                                                \
  }
RCLCPP_GET_INTERFACE_(NodeBaseInterface, get_node_base_interface)
RCLCPP_GET_INTERFACE_(NodeClockInterface, get_node_clock_interface)
RCLCPP_GET_INTERFACE_(NodeGraphInterface, get_node_graph_interface)
RCLCPP_GET_INTERFACE_(NodeLoggingInterface, get_node_logging_interface)
RCLCPP_GET_INTERFACE_(NodeParametersInterface, get_node_parameters_interface)
RCLCPP_GET_INTERFACE_(NodeServicesInterface, get_node_services_interface)
RCLCPP_GET_INTERFACE_(NodeTimeSourceInterface, get_node_time_source_interface)
RCLCPP_GET_INTERFACE_(NodeTimersInterface, get_node_timers_interface)
RCLCPP_GET_INTERFACE_(NodeTopicsInterface, get_node_topics_interface)
RCLCPP_GET_INTERFACE_(NodeTypeDescriptionsInterface, get_node_type_descriptions_interface)
RCLCPP_GET_INTERFACE_(NodeWaitablesInterface, get_node_waitables_interface)
#undef RCLCPP_GET_INTERFACE_

/// The interfaces of a node that a function needs, as template arguments.
/// Thread safety: a value. Real-time: no.
template <class... Interfaces>
class NodeInterfaces {
  template <class I>
  static constexpr bool kHas = (std::is_same_v<I, Interfaces> || ...);

 public:
  NodeInterfaces() = default;
  template <class N>
  requires(sizeof...(Interfaces) != 0 && !std::is_same_v<std::remove_cvref_t<N>, NodeInterfaces> &&
           !(std::is_convertible_v<N, std::shared_ptr<Interfaces>> || ...))
      NodeInterfaces(N&& node)  // NOLINT: as in rclcpp
      : interfaces_(of(node, std::type_identity<Interfaces>())...) {}
  explicit NodeInterfaces(std::shared_ptr<Interfaces>... interfaces)
      : interfaces_(std::move(interfaces)...) {}

  template <class I>
  std::shared_ptr<I> get() const {
    return std::get<std::shared_ptr<I>>(interfaces_);
  }
#define RCLCPP_HAS_INTERFACE_(Type, getter)                            \
  std::shared_ptr<Type> getter() const requires kHas<Type> {           \
    return get<Type>();                                                \
  }                                                                    \
                                                                       \
 private:                                                              \
  template <class N>                                                   \
  static std::shared_ptr<Type> of(N& node, std::type_identity<Type>) { \
    return node_interfaces::getter(node);                              \
  }                                                                    \
                                                                       \
 public:
  RCLCPP_HAS_INTERFACE_(NodeBaseInterface, get_node_base_interface)
  RCLCPP_HAS_INTERFACE_(NodeClockInterface, get_node_clock_interface)
  RCLCPP_HAS_INTERFACE_(NodeGraphInterface, get_node_graph_interface)
  RCLCPP_HAS_INTERFACE_(NodeLoggingInterface, get_node_logging_interface)
  RCLCPP_HAS_INTERFACE_(NodeParametersInterface, get_node_parameters_interface)
  RCLCPP_HAS_INTERFACE_(NodeServicesInterface, get_node_services_interface)
  RCLCPP_HAS_INTERFACE_(NodeTimeSourceInterface, get_node_time_source_interface)
  RCLCPP_HAS_INTERFACE_(NodeTimersInterface, get_node_timers_interface)
  RCLCPP_HAS_INTERFACE_(NodeTopicsInterface, get_node_topics_interface)
  RCLCPP_HAS_INTERFACE_(NodeTypeDescriptionsInterface, get_node_type_descriptions_interface)
  RCLCPP_HAS_INTERFACE_(NodeWaitablesInterface, get_node_waitables_interface)
#undef RCLCPP_HAS_INTERFACE_

 private:
  std::tuple<std::shared_ptr<Interfaces>...> interfaces_;
};

}  // namespace node_interfaces
}  // namespace rclcpp

#endif  // RCLCPP__NODE_INTERFACES__NODE_INTERFACES_HPP_
