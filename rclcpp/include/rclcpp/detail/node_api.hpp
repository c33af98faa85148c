// The methods that every class of node offers: rclcpp::Node, and the lifecycle node.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__NODE_API_HPP_
#define RCLCPP__DETAIL__NODE_API_HPP_

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rclcpp/create_publisher.hpp"
#include "rclcpp/detail/refused.hpp"
#include "rclcpp/generic_publisher.hpp"
#include "rclcpp/generic_subscription.hpp"
#include "rclcpp/node_interfaces/node_interfaces.hpp"

namespace rclcpp::detail {

/// Thread safety: every method from any thread. Real-time: set-up only, except now(), the logger,
/// and parameters that are numbers.
class NodeApi {
  template <class T>
  using Ptr = std::shared_ptr<T>;
  template <class M, class Allocator>
  using MessageMemory = message_memory_strategy::MessageMemoryStrategy<M, Allocator>;

 public:
  NodeApi(const NodeApi&) = delete;
  NodeApi& operator=(const NodeApi&) = delete;

  const char* get_name() const { return base_->get_name(); }
  const char* get_namespace() const { return base_->get_namespace(); }
  const char* get_fully_qualified_name() const { return base_->get_fully_qualified_name(); }
  Logger get_logger() const { return logging_->get_logger(); }
  Clock::SharedPtr get_clock() { return clock_->get_clock(); }
  Clock::ConstSharedPtr get_clock() const { return std::as_const(*clock_).get_clock(); }
  Time now() const { return get_clock()->now(); }
  const NodeOptions& get_node_options() const { return base_->options(); }

  CallbackGroup::SharedPtr create_callback_group(
      CallbackGroupType type, bool automatically_add_to_executor_with_node = true) {
    return base_->create_callback_group(type, automatically_add_to_executor_with_node);
  }
  void for_each_callback_group(const std::function<void(CallbackGroup::SharedPtr)>& function) {
    base_->for_each_callback_group(function);
  }

  template <class M, class F, class Allocator = std::allocator<void>,
            class T = Subscription<M, Allocator>>
  Ptr<T> create_subscription(const std::string& topic, const QoS& qos, F&& callback,
                             const SubscriptionOptionsWithAllocator<Allocator>& options = {},
                             const Ptr<MessageMemory<M, Allocator>>& = nullptr) {
    return rclcpp::create_subscription<M, F, Allocator, T>(parameters_, base_, in_sub(topic), qos,
                                                           std::forward<F>(callback), options);
  }
  template <class Rep, class Period, class F>
  typename WallTimer<std::decay_t<F>>::SharedPtr create_wall_timer(
      std::chrono::duration<Rep, Period> period, F&& callback,
      CallbackGroup::SharedPtr group = nullptr, bool autostart = true) {
    return rclcpp::create_wall_timer(period, std::forward<F>(callback), std::move(group),
                                     base_.get(), timers_.get(), autostart);
  }
  template <class Rep, class Period, class F>
  typename GenericTimer<std::decay_t<F>>::SharedPtr create_timer(
      std::chrono::duration<Rep, Period> period, F&& callback,
      CallbackGroup::SharedPtr group = nullptr) {
    return rclcpp::create_timer(get_clock(), period, std::forward<F>(callback), std::move(group),
                                base_.get(), timers_.get());
  }
  template <class S>
  typename Client<S>::SharedPtr create_client(const std::string& service,
                                              const QoS& qos = ServicesQoS(),
                                              CallbackGroup::SharedPtr group = nullptr) {
    return std::make_shared<Client<S>>(*base_, in_sub(service), qos, std::move(group));
  }
  template <class S>
  [[deprecated("use rclcpp::QoS: see docs/reference/rclcpp.md")]] typename Client<S>::SharedPtr
  create_client(const std::string& service, const rmw_qos_profile_t& profile,
                CallbackGroup::SharedPtr group = nullptr) {
    return create_client<S>(service, qos_from_rmw(profile), std::move(group));
  }
  template <class S, class F>
  typename Service<S>::SharedPtr create_service(const std::string& service, F&& callback,
                                                const QoS& qos = ServicesQoS(),
                                                CallbackGroup::SharedPtr group = nullptr) {
    return rclcpp::create_service<S>(base_, services_, in_sub(service), std::forward<F>(callback),
                                     qos, std::move(group));
  }
  template <class S, class F>
  [[deprecated("use rclcpp::QoS: see docs/reference/rclcpp.md")]] typename Service<S>::SharedPtr
  create_service(const std::string& service, F&& callback, const rmw_qos_profile_t& profile,
                 CallbackGroup::SharedPtr group = nullptr) {
    return create_service<S>(service, std::forward<F>(callback), qos_from_rmw(profile),
                             std::move(group));
  }
  GenericPublisher::SharedPtr create_generic_publisher(const std::string& topic,
                                                       const std::string& type, const QoS& qos,
                                                       const PublisherOptions& options = {}) {
    return std::make_shared<GenericPublisher>(*base_, in_sub(topic), type, qos, options);
  }
  template <class F>
  GenericSubscription::SharedPtr create_generic_subscription(
      const std::string& topic, const std::string& type, const QoS& qos, F&& callback,
      const SubscriptionOptions& options = {}) {
    return std::make_shared<GenericSubscription>(*base_, in_sub(topic), type, qos,
                                                 std::forward<F>(callback), options);
  }

  RCLCPP_REFUSED_(create_generic_client, "generic clients")

  // ---- Parameters ----

  ParameterValue declare_parameter(const std::string& name, const ParameterValue& value,
                                   const rcl_interfaces::msg::ParameterDescriptor& descriptor = {},
                                   bool ignore_override = false) {
    return parameters_->declare_parameter(name, value, descriptor, ignore_override);
  }
  ParameterValue declare_parameter(const std::string& name, ParameterType type,
                                   const rcl_interfaces::msg::ParameterDescriptor& descriptor = {},
                                   bool ignore_override = false) {
    return parameters_->declare_parameter(name, type, descriptor, ignore_override);
  }
  template <class T>
  requires(kIsParameter<T> && !std::is_same_v<T, ParameterType>) auto declare_parameter(
      const std::string& name, const T& value,
      const rcl_interfaces::msg::ParameterDescriptor& descriptor = {},
      bool ignore_override = false) {
    using Value = std::conditional_t<std::is_convertible_v<T, std::string>, std::string, T>;
    try {
      return Value(declare_parameter(name, ParameterValue(value), descriptor, ignore_override)
                       .template get<Value>());
    } catch (const ParameterTypeException& exception) {
      throw exceptions::InvalidParameterTypeException(name, exception.what());
    }
  }
  template <class T>
  requires kIsParameter<T>
  auto declare_parameter(const std::string& name,
                         const rcl_interfaces::msg::ParameterDescriptor& descriptor = {},
                         bool ignore_override = false) {
    const ParameterValue value =
        declare_parameter(name, parameter_type_of<T>(), descriptor, ignore_override);
    if (value.get_type() == PARAMETER_NOT_SET) {
      throw exceptions::UninitializedStaticallyTypedParameterException(name);
    }
    return T(value.get<T>());
  }
  template <class T>
  std::vector<T> declare_parameters(const std::string& name_space,
                                    const std::map<std::string, T>& parameters,
                                    bool ignore_overrides = false) {
    std::vector<T> values;
    for (const auto& [name, value] : parameters) {
      values.push_back(declare_parameter(joined(name_space, name), value,
                                         rcl_interfaces::msg::ParameterDescriptor(),
                                         ignore_overrides));
    }
    return values;
  }
  template <class T>
  std::vector<T> declare_parameters(
      const std::string& name_space,
      const std::map<std::string, std::pair<T, rcl_interfaces::msg::ParameterDescriptor>>&
          parameters,
      bool ignore_overrides = false) {
    std::vector<T> values;
    for (const auto& [name, parameter] : parameters) {
      values.push_back(declare_parameter(joined(name_space, name), parameter.first,
                                         parameter.second, ignore_overrides));
    }
    return values;
  }
  void undeclare_parameter(const std::string& name) { parameters_->undeclare_parameter(name); }
  bool has_parameter(const std::string& name) const { return parameters_->has_parameter(name); }
  rcl_interfaces::msg::SetParametersResult set_parameter(const Parameter& parameter) {
    return parameters_->set_parameters_atomically({parameter});
  }
  std::vector<rcl_interfaces::msg::SetParametersResult> set_parameters(
      const std::vector<Parameter>& parameters) {
    return parameters_->set_parameters(parameters);
  }
  rcl_interfaces::msg::SetParametersResult set_parameters_atomically(
      const std::vector<Parameter>& parameters) {
    return parameters_->set_parameters_atomically(parameters);
  }
  Parameter get_parameter(const std::string& name) const {
    return parameters_->get_parameter(name);
  }
  bool get_parameter(const std::string& name, Parameter& parameter) const {
    return parameters_->get_parameter(name, parameter);
  }
  template <class T>
  bool get_parameter(const std::string& name, T& value) const {
    Parameter parameter;
    const bool is_set = get_parameter(name, parameter);
    if (is_set) value = static_cast<T>(parameter.get_value<T>());
    return is_set;
  }
  template <class T>
  bool get_parameter_or(const std::string& name, T& value, const T& alternative) const {
    const bool is_set = get_parameter(name, value);
    if (!is_set) value = alternative;
    return is_set;
  }
  template <class T>
  T get_parameter_or(const std::string& name, const T& alternative) const {
    T value;
    get_parameter_or(name, value, alternative);
    return value;
  }
  std::vector<Parameter> get_parameters(const std::vector<std::string>& names) const {
    return parameters_->get_parameters(names);
  }
  /// The parameters with names of the form "PREFIX.x", under the keys "x".
  template <class T>
  bool get_parameters(const std::string& prefix, std::map<std::string, T>& values) const {
    std::map<std::string, Parameter> parameters;
    const bool has_any = parameters_->get_parameters_by_prefix(prefix, parameters);
    for (const auto& [name, parameter] : parameters) {
      values[name] = static_cast<T>(parameter.template get_value<T>());
    }
    return has_any;
  }
  rcl_interfaces::msg::ParameterDescriptor describe_parameter(const std::string& name) const {
    return parameters_->describe_parameters({name}).front();
  }
  std::vector<rcl_interfaces::msg::ParameterDescriptor> describe_parameters(
      const std::vector<std::string>& names) const {
    return parameters_->describe_parameters(names);
  }
  std::vector<std::uint8_t> get_parameter_types(const std::vector<std::string>& names) const {
    return parameters_->get_parameter_types(names);
  }
  rcl_interfaces::msg::ListParametersResult list_parameters(
      const std::vector<std::string>& prefixes, std::uint64_t depth) const {
    return parameters_->list_parameters(prefixes, depth);
  }
  using PreSetParametersCallbackHandle = node_interfaces::PreSetParametersCallbackHandle;
  using OnSetParametersCallbackHandle = node_interfaces::OnSetParametersCallbackHandle;
  using PostSetParametersCallbackHandle = node_interfaces::PostSetParametersCallbackHandle;
  using PreSetParametersCallbackType = PreSetParametersCallbackHandle::CallbackType;
  using OnSetParametersCallbackType = OnSetParametersCallbackHandle::CallbackType;
  using PostSetParametersCallbackType = PostSetParametersCallbackHandle::CallbackType;
  [[nodiscard]] PreSetParametersCallbackHandle::SharedPtr add_pre_set_parameters_callback(
      PreSetParametersCallbackType callback) {
    return parameters_->add_pre_set_parameters_callback(std::move(callback));
  }
  [[nodiscard]] OnSetParametersCallbackHandle::SharedPtr add_on_set_parameters_callback(
      OnSetParametersCallbackType callback) {
    return parameters_->add_on_set_parameters_callback(std::move(callback));
  }
  [[nodiscard]] PostSetParametersCallbackHandle::SharedPtr add_post_set_parameters_callback(
      PostSetParametersCallbackType callback) {
    return parameters_->add_post_set_parameters_callback(std::move(callback));
  }
  void remove_pre_set_parameters_callback(const PreSetParametersCallbackHandle* handle) {
    parameters_->remove_pre_set_parameters_callback(handle);
  }
  void remove_on_set_parameters_callback(const OnSetParametersCallbackHandle* handle) {
    parameters_->remove_on_set_parameters_callback(handle);
  }
  void remove_post_set_parameters_callback(const PostSetParametersCallbackHandle* handle) {
    parameters_->remove_post_set_parameters_callback(handle);
  }

  // ---- The graph ----

  using NamesAndTypes = node_interfaces::NodeGraphInterface::NamesAndTypes;
  std::vector<std::string> get_node_names() const { return graph_->get_node_names(); }
  NamesAndTypes get_topic_names_and_types() const { return graph_->get_topic_names_and_types(); }
  NamesAndTypes get_service_names_and_types() const {
    return graph_->get_service_names_and_types();
  }
  NamesAndTypes get_service_names_and_types_by_node(const std::string& node,
                                                    const std::string& name_space) const {
    return graph_->get_service_names_and_types_by_node(node, name_space);
  }
  std::size_t count_publishers(const std::string& topic) const {
    return graph_->count_publishers(topic);
  }
  std::size_t count_subscribers(const std::string& topic) const {
    return graph_->count_subscribers(topic);
  }
  std::size_t count_clients(const std::string& service) const {
    return graph_->count_clients(service);
  }
  std::size_t count_services(const std::string& service) const {
    return graph_->count_services(service);
  }
  std::vector<TopicEndpointInfo> get_publishers_info_by_topic(const std::string& topic,
                                                              bool no_mangle = false) const {
    return graph_->get_publishers_info_by_topic(topic, no_mangle);
  }
  std::vector<TopicEndpointInfo> get_subscriptions_info_by_topic(const std::string& topic,
                                                                 bool no_mangle = false) const {
    return graph_->get_subscriptions_info_by_topic(topic, no_mangle);
  }

  RCLCPP_REFUSED_(get_graph_event, "events of the graph")
  RCLCPP_REFUSED_(wait_for_graph_change, "events of the graph")
  // ---- Interfaces ----

#define RCLCPP_INTERFACE_(Type, get, member)          \
  node_interfaces::Type::SharedPtr get() {            \
    return member;                                    \
  }                                                   \
  node_interfaces::Type::ConstSharedPtr get() const { \
    return member;                                    \
  }
  RCLCPP_INTERFACE_(NodeBaseInterface, get_node_base_interface, base_)
  RCLCPP_INTERFACE_(NodeClockInterface, get_node_clock_interface, clock_)
  RCLCPP_INTERFACE_(NodeGraphInterface, get_node_graph_interface, graph_)
  RCLCPP_INTERFACE_(NodeLoggingInterface, get_node_logging_interface, logging_)
  RCLCPP_INTERFACE_(NodeParametersInterface, get_node_parameters_interface, parameters_)
  RCLCPP_INTERFACE_(NodeServicesInterface, get_node_services_interface, services_)
  RCLCPP_INTERFACE_(NodeTimeSourceInterface, get_node_time_source_interface, time_source_)
  RCLCPP_INTERFACE_(NodeTimersInterface, get_node_timers_interface, timers_)
  RCLCPP_INTERFACE_(NodeTopicsInterface, get_node_topics_interface, topics_)
  RCLCPP_INTERFACE_(NodeTypeDescriptionsInterface, get_node_type_descriptions_interface,
                    type_descriptions_)
  RCLCPP_INTERFACE_(NodeWaitablesInterface, get_node_waitables_interface, waitables_)
#undef RCLCPP_INTERFACE_

  const std::string& get_sub_namespace() const {
    return sub_;
  }
  std::string get_effective_namespace() const {
    const std::string outer = get_namespace();
    if (sub_.empty()) return outer;
    return (outer == "/" ? "" : outer) + "/" + sub_;
  }

 protected:
  NodeApi(const std::string& name, const std::string& name_space, const NodeOptions& options,
          const node_interfaces::NodeBaseInterface::MakeNode& make);
  /// A sub-node: the same node, but relative names get the prefix `sub`.
  NodeApi(const NodeApi& other, const std::string& sub);
  ~NodeApi() = default;

  std::string in_sub(const std::string& name) const {
    const bool is_relative = !name.empty() && name[0] != '/' && name[0] != '~';
    return sub_.empty() || !is_relative ? name : sub_ + "/" + name;
  }

 private:
  static std::string joined(const std::string& name_space, const std::string& name) {
    return name_space.empty() ? name : name_space + "." + name;
  }

  const Ptr<node_interfaces::NodeBaseInterface> base_;
  const Ptr<node_interfaces::NodeClockInterface> clock_;
  const Ptr<node_interfaces::NodeGraphInterface> graph_;
  const Ptr<node_interfaces::NodeLoggingInterface> logging_;
  const Ptr<node_interfaces::NodeParametersInterface> parameters_;
  const Ptr<node_interfaces::NodeServicesInterface> services_;
  const Ptr<node_interfaces::NodeTimeSourceInterface> time_source_;
  const Ptr<node_interfaces::NodeTimersInterface> timers_;
  const Ptr<node_interfaces::NodeTopicsInterface> topics_;
  const Ptr<node_interfaces::NodeTypeDescriptionsInterface> type_descriptions_;
  const Ptr<node_interfaces::NodeWaitablesInterface> waitables_;
  const std::string sub_;
};

}  // namespace rclcpp::detail

#endif  // RCLCPP__DETAIL__NODE_API_HPP_
