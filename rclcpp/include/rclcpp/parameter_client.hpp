// Clients of the parameters of other nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_CLIENT_HPP_
#define RCLCPP__PARAMETER_CLIENT_HPP_

#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/messages/rcl_interfaces/msg/parameter_event.hpp"

#include "rclcpp/executors.hpp"

namespace rclcpp {

/// Responses arrive only while the node is spun.
/// Thread safety: every method from any thread. Real-time: no.
class AsyncParametersClient {
  template <class T>
  using Callback = std::function<void(std::shared_future<T>)>;
  using Results = std::vector<rcl_interfaces::msg::SetParametersResult>;
  using Descriptors = std::vector<rcl_interfaces::msg::ParameterDescriptor>;

 public:
  RCLCPP_SMART_PTR_DEFINITIONS(AsyncParametersClient)

  /// `remote_node`: the name of the node with the parameters; empty: the node itself.
  AsyncParametersClient(node_interfaces::NodeBaseInterface::SharedPtr base,
                        node_interfaces::NodeTopicsInterface::SharedPtr,
                        node_interfaces::NodeGraphInterface::SharedPtr,
                        node_interfaces::NodeServicesInterface::SharedPtr,
                        const std::string& remote_node = "", const QoS& qos = ParametersQoS(),
                        CallbackGroup::SharedPtr group = nullptr)
      : AsyncParametersClient(std::move(base), remote_node, qos, std::move(group)) {}
  template <class N>
  explicit AsyncParametersClient(const std::shared_ptr<N> node, const std::string& remote_node = "",
                                 const QoS& qos = ParametersQoS(),
                                 CallbackGroup::SharedPtr group = nullptr)
      : AsyncParametersClient(node->get_node_base_interface(), remote_node, qos, std::move(group)) {
  }
  template <class N>
  explicit AsyncParametersClient(N* node, const std::string& remote_node = "",
                                 const QoS& qos = ParametersQoS(),
                                 CallbackGroup::SharedPtr group = nullptr)
      : AsyncParametersClient(node->get_node_base_interface(), remote_node, qos, std::move(group)) {
  }
  explicit AsyncParametersClient(node_interfaces::NodeBaseInterface::SharedPtr base,
                                 const std::string& remote_node, const QoS& qos,
                                 CallbackGroup::SharedPtr group);

  std::shared_future<std::vector<Parameter>> get_parameters(
      const std::vector<std::string>& names, Callback<std::vector<Parameter>> callback = nullptr);
  std::shared_future<Descriptors> describe_parameters(const std::vector<std::string>& names,
                                                      Callback<Descriptors> callback = nullptr);
  std::shared_future<std::vector<ParameterType>> get_parameter_types(
      const std::vector<std::string>& names,
      Callback<std::vector<ParameterType>> callback = nullptr);
  std::shared_future<Results> set_parameters(const std::vector<Parameter>& parameters,
                                             Callback<Results> callback = nullptr);
  std::shared_future<rcl_interfaces::msg::SetParametersResult> set_parameters_atomically(
      const std::vector<Parameter>& parameters,
      Callback<rcl_interfaces::msg::SetParametersResult> callback = nullptr);
  std::shared_future<Results> delete_parameters(const std::vector<std::string>& names);
  /// Sets the parameters that a file has for the remote node.
  std::shared_future<Results> load_parameters(const std::string& yaml_file);
  std::shared_future<rcl_interfaces::msg::ListParametersResult> list_parameters(
      const std::vector<std::string>& prefixes, std::uint64_t depth,
      Callback<rcl_interfaces::msg::ListParametersResult> callback = nullptr);

  template <class F>
  Subscription<rcl_interfaces::msg::ParameterEvent>::SharedPtr on_parameter_event(
      F&& callback, const QoS& qos = ParameterEventsQoS(),
      const SubscriptionOptions& options = {}) {
    return make_subscription(*base_, std::forward<F>(callback), qos, options);
  }
  template <class F, class N>
  static Subscription<rcl_interfaces::msg::ParameterEvent>::SharedPtr on_parameter_event(
      N&& node, F&& callback, const QoS& qos = ParameterEventsQoS(),
      const SubscriptionOptions& options = {}) {
    return make_subscription(detail::base_of(node), std::forward<F>(callback), qos, options);
  }

  bool service_is_ready() const;
  template <class Rep = std::int64_t, class Period = std::milli>
  bool wait_for_service(
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
    return detail::wait_for(*base_->get_context(),
                            std::chrono::duration_cast<std::chrono::nanoseconds>(timeout),
                            [this] { return service_is_ready(); });
  }

 private:
  struct Clients;
  template <class F>
  static Subscription<rcl_interfaces::msg::ParameterEvent>::SharedPtr make_subscription(
      node_interfaces::NodeBaseInterface& base, F&& callback, const QoS& qos,
      const SubscriptionOptions& options) {
    return std::make_shared<Subscription<rcl_interfaces::msg::ParameterEvent>>(
        base, "/parameter_events", qos, std::decay_t<F>(callback), options,
        detail::QosParameters());
  }

  const node_interfaces::NodeBaseInterface::SharedPtr base_;
  const std::string remote_;
  const std::shared_ptr<Clients> clients_;
};

/// Spins the node until the response has come, on an executor of its own or the given one. The node
/// must not be in another executor.
/// Thread safety: of one thread. Real-time: no.
class SyncParametersClient {
  using Timeout = std::chrono::nanoseconds;
  static constexpr Timeout kForEver{-1};

 public:
  RCLCPP_SMART_PTR_DEFINITIONS(SyncParametersClient)

  template <class N>
  explicit SyncParametersClient(std::shared_ptr<N> node, const std::string& remote_node = "",
                                const QoS& qos = ParametersQoS())
      : SyncParametersClient(std::make_shared<executors::SingleThreadedExecutor>(), std::move(node),
                             remote_node, qos) {}
  template <class N>
  explicit SyncParametersClient(N* node, const std::string& remote_node = "",
                                const QoS& qos = ParametersQoS())
      : SyncParametersClient(std::make_shared<executors::SingleThreadedExecutor>(), node,
                             remote_node, qos) {}
  template <class N>
  SyncParametersClient(Executor::SharedPtr executor, N node, const std::string& remote_node = "",
                       const QoS& qos = ParametersQoS())
      : executor_(std::move(executor)),
        base_(node->get_node_base_interface()),
        client_(std::make_shared<AsyncParametersClient>(base_, remote_node, qos, nullptr)) {}

  std::vector<Parameter> get_parameters(const std::vector<std::string>& names,
                                        Timeout timeout = kForEver) {
    return wait(client_->get_parameters(names), timeout);
  }
  bool has_parameter(const std::string& name) { return !list_parameters({name}, 1).names.empty(); }
  template <class T>
  T get_parameter(const std::string& name, const T& alternative) {
    const auto parameters = get_parameters({name});
    if (parameters.size() != 1 || parameters[0].get_type() == PARAMETER_NOT_SET) {
      return alternative;
    }
    return static_cast<T>(parameters[0].template get_value<T>());
  }
  template <class T>
  T get_parameter(const std::string& name) {
    const auto parameters = get_parameters({name});
    if (parameters.size() != 1 || parameters[0].get_type() == PARAMETER_NOT_SET) {
      throw std::runtime_error("Parameter '" + name + "' is not set");
    }
    return static_cast<T>(parameters[0].template get_value<T>());
  }
  std::vector<rcl_interfaces::msg::ParameterDescriptor> describe_parameters(
      const std::vector<std::string>& names, Timeout timeout = kForEver) {
    return wait(client_->describe_parameters(names), timeout);
  }
  std::vector<ParameterType> get_parameter_types(const std::vector<std::string>& names,
                                                 Timeout timeout = kForEver) {
    return wait(client_->get_parameter_types(names), timeout);
  }
  std::vector<rcl_interfaces::msg::SetParametersResult> set_parameters(
      const std::vector<Parameter>& parameters, Timeout timeout = kForEver) {
    return wait(client_->set_parameters(parameters), timeout);
  }
  rcl_interfaces::msg::SetParametersResult set_parameters_atomically(
      const std::vector<Parameter>& parameters, Timeout timeout = kForEver) {
    return wait(client_->set_parameters_atomically(parameters), timeout);
  }
  std::vector<rcl_interfaces::msg::SetParametersResult> delete_parameters(
      const std::vector<std::string>& names, Timeout timeout = kForEver) {
    return wait(client_->delete_parameters(names), timeout);
  }
  std::vector<rcl_interfaces::msg::SetParametersResult> load_parameters(
      const std::string& yaml_file, Timeout timeout = kForEver) {
    return wait(client_->load_parameters(yaml_file), timeout);
  }
  rcl_interfaces::msg::ListParametersResult list_parameters(
      const std::vector<std::string>& prefixes, std::uint64_t depth, Timeout timeout = kForEver) {
    return wait(client_->list_parameters(prefixes, depth), timeout);
  }
  template <class F>
  auto on_parameter_event(F&& callback) {
    return client_->on_parameter_event(std::forward<F>(callback));
  }

  bool service_is_ready() const { return client_->service_is_ready(); }
  template <class Rep = std::int64_t, class Period = std::milli>
  bool wait_for_service(
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
    return client_->wait_for_service(timeout);
  }

 private:
  /// The response; an empty value if none came in time.
  template <class T>
  T wait(const std::shared_future<T>& future, Timeout timeout) {
    const auto code =
        executors::spin_node_until_future_complete(*executor_, base_, future, timeout);
    return code == FutureReturnCode::SUCCESS ? future.get() : T();
  }

  const Executor::SharedPtr executor_;
  const node_interfaces::NodeBaseInterface::SharedPtr base_;
  const AsyncParametersClient::SharedPtr client_;
};

}  // namespace rclcpp

#endif  // RCLCPP__PARAMETER_CLIENT_HPP_
