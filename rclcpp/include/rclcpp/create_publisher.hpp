// Makes publishers, subscriptions, services, clients and timers for any class of node.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__CREATE_PUBLISHER_HPP_
#define RCLCPP__CREATE_PUBLISHER_HPP_

#include <chrono>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "rclcpp/client.hpp"
#include "rclcpp/message_memory_strategy.hpp"
#include "rclcpp/node_interfaces/node_interfaces.hpp"
#include "rclcpp/publisher.hpp"
#include "rclcpp/service.hpp"
#include "rclcpp/subscription.hpp"
#include "rclcpp/timer.hpp"

namespace rclcpp {

namespace detail {
/// The base interface of a node, from the node or any of its interfaces.
template <class N>
node_interfaces::NodeBaseInterface& base_of(N&& node) {
  if constexpr (requires { dereferenced(node).resolve_topic_or_service_name("", false); }) {
    return dereferenced(node);
  } else {
    return *dereferenced(node).get_node_base_interface();
  }
}
/// The QoS override parameters, from a node or its parameters interface. Other interfaces of a node
/// give no access to parameters: with these, options that override QoS throw.
template <class N>
QosParameters qos_parameters_of(N&& node) {
  using Parameters = node_interfaces::NodeParametersInterface;
  if constexpr (std::is_convertible_v<N, std::shared_ptr<Parameters>> ||
                requires { dereferenced(node).get_node_parameters_interface(); }) {
    return QosParameters(*node_interfaces::get_node_parameters_interface(std::forward<N>(node)));
  } else {
    return QosParameters();
  }
}
}  // namespace detail

template <class M, class Allocator = std::allocator<void>, class P = Publisher<M, Allocator>,
          class Parameters, class N>
std::shared_ptr<P> create_publisher(Parameters&& node_parameters, N&& node,
                                    const std::string& topic, const QoS& qos,
                                    const PublisherOptionsWithAllocator<Allocator>& options = {}) {
  return std::make_shared<P>(detail::base_of(node), topic, qos, options,
                             detail::qos_parameters_of(node_parameters));
}
template <class M, class Allocator = std::allocator<void>, class P = Publisher<M, Allocator>,
          class N>
requires(!std::is_convertible_v<N, std::string>) std::shared_ptr<P> create_publisher(
    N&& node, const std::string& topic, const QoS& qos,
    const PublisherOptionsWithAllocator<Allocator>& options = {}) {
  return create_publisher<M, Allocator, P>(node, node, topic, qos, options);
}

template <class M, class F, class Allocator = std::allocator<void>,
          class T = Subscription<M, Allocator>, class Parameters, class N>
std::shared_ptr<T> create_subscription(
    Parameters&& node_parameters, N&& node, const std::string& topic, const QoS& qos, F&& callback,
    const SubscriptionOptionsWithAllocator<Allocator>& options = {},
    const std::shared_ptr<message_memory_strategy::MessageMemoryStrategy<M, Allocator>>& =
        nullptr) {
  return std::make_shared<T>(detail::base_of(node), topic, qos, std::decay_t<F>(callback), options,
                             detail::qos_parameters_of(node_parameters));
}
template <class M, class F, class Allocator = std::allocator<void>,
          class T = Subscription<M, Allocator>, class N>
requires(!std::is_convertible_v<N, std::string>) std::shared_ptr<T> create_subscription(
    N&& node, const std::string& topic, const QoS& qos, F&& callback,
    const SubscriptionOptionsWithAllocator<Allocator>& options = {},
    const std::shared_ptr<message_memory_strategy::MessageMemoryStrategy<M, Allocator>>& =
        nullptr) {
  return create_subscription<M, F, Allocator, T>(node, node, topic, qos, std::forward<F>(callback),
                                                 options);
}

template <class S, class F, class Base, class Services>
typename Service<S>::SharedPtr create_service(const std::shared_ptr<Base>& base, const Services&,
                                              const std::string& name, F&& callback, const QoS& qos,
                                              CallbackGroup::SharedPtr group) {
  return Service<S>::template make<std::decay_t<F>>(*base, name, std::forward<F>(callback), qos,
                                                    std::move(group));
}
template <class S, class F, class Base, class Services>
[[deprecated("use rclcpp::QoS: see docs/reference/rclcpp.md")]] typename Service<S>::SharedPtr
create_service(const std::shared_ptr<Base>& base, const Services& services, const std::string& name,
               F&& callback, const rmw_qos_profile_t& profile, CallbackGroup::SharedPtr group) {
  return create_service<S>(base, services, name, std::forward<F>(callback),
                           detail::qos_from_rmw(profile), std::move(group));
}
template <class S, class F, class N>
typename Service<S>::SharedPtr create_service(N& node, const std::string& name, F&& callback,
                                              const QoS& qos = ServicesQoS(),
                                              CallbackGroup::SharedPtr group = nullptr) {
  return Service<S>::template make<std::decay_t<F>>(
      detail::base_of(node), name, std::forward<F>(callback), qos, std::move(group));
}

template <class S, class Base, class Graph, class Services>
typename Client<S>::SharedPtr create_client(const std::shared_ptr<Base>& base, const Graph&,
                                            const Services&, const std::string& name,
                                            const QoS& qos = ServicesQoS(),
                                            CallbackGroup::SharedPtr group = nullptr) {
  return std::make_shared<Client<S>>(*base, name, qos, std::move(group));
}
template <class S, class Base, class Graph, class Services>
[[deprecated("use rclcpp::QoS: see docs/reference/rclcpp.md")]] typename Client<S>::SharedPtr
create_client(const std::shared_ptr<Base>& base, const Graph& graph, const Services& services,
              const std::string& name, const rmw_qos_profile_t& profile,
              CallbackGroup::SharedPtr group) {
  return create_client<S>(base, graph, services, name, detail::qos_from_rmw(profile),
                          std::move(group));
}
template <class S, class N>
typename Client<S>::SharedPtr create_client(N& node, const std::string& name,
                                            const QoS& qos = ServicesQoS(),
                                            CallbackGroup::SharedPtr group = nullptr) {
  return std::make_shared<Client<S>>(detail::base_of(node), name, qos, std::move(group));
}

template <class Rep, class Period, class F>
typename WallTimer<std::decay_t<F>>::SharedPtr create_wall_timer(
    std::chrono::duration<Rep, Period> period, F&& callback, CallbackGroup::SharedPtr group,
    node_interfaces::NodeBaseInterface* node, node_interfaces::NodeTimersInterface*,
    bool autostart = true) {
  if (node == nullptr) throw std::invalid_argument("input node_base cannot be null");
  const auto ns = detail::timer_period(period);
  auto timer = std::make_shared<WallTimer<std::decay_t<F>>>(ns, std::forward<F>(callback), nullptr,
                                                            autostart);
  timer->add_to(*node->takt_node(), node->next_timer_name(ns), std::move(group));
  return timer;
}
template <class Rep, class Period, class F>
typename GenericTimer<std::decay_t<F>>::SharedPtr create_timer(
    Clock::SharedPtr clock, std::chrono::duration<Rep, Period> period, F&& callback,
    CallbackGroup::SharedPtr group, node_interfaces::NodeBaseInterface* node,
    node_interfaces::NodeTimersInterface*, bool autostart = true) {
  if (node == nullptr) throw std::invalid_argument("input node_base cannot be null");
  const auto ns = detail::timer_period(period);
  auto timer = std::make_shared<GenericTimer<std::decay_t<F>>>(
      std::move(clock), ns, std::forward<F>(callback), nullptr, autostart);
  timer->add_to(*node->takt_node(), node->next_timer_name(ns), std::move(group));
  return timer;
}
template <class F>
TimerBase::SharedPtr create_timer(node_interfaces::NodeBaseInterface::SharedPtr base,
                                  node_interfaces::NodeTimersInterface::SharedPtr timers,
                                  Clock::SharedPtr clock, Duration period, F&& callback,
                                  CallbackGroup::SharedPtr group = nullptr, bool autostart = true) {
  return create_timer(std::move(clock), period.to_chrono(), std::forward<F>(callback),
                      std::move(group), base.get(), timers.get(), autostart);
}
template <class N, class F>
TimerBase::SharedPtr create_timer(N node, Clock::SharedPtr clock, Duration period, F&& callback,
                                  CallbackGroup::SharedPtr group = nullptr, bool autostart = true) {
  return create_timer(std::move(clock), period.to_chrono(), std::forward<F>(callback),
                      std::move(group), &detail::base_of(node),
                      static_cast<node_interfaces::NodeTimersInterface*>(nullptr), autostart);
}

}  // namespace rclcpp

#endif  // RCLCPP__CREATE_PUBLISHER_HPP_
