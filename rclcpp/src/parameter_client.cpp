// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/parameter_client.hpp"

#include <algorithm>
#include <utility>

#include "parameter_yaml.hpp"

namespace rclcpp {
namespace {

/// Sends the request; the future and the callback get the response as `convert` returns it.
template <class S, class Convert, class Callback>
auto call(const std::shared_ptr<Client<S>>& client, typename S::Request request, Convert convert,
          Callback callback) {
  using Value = decltype(convert(std::declval<const typename S::Response&>()));
  auto promise = std::make_shared<std::promise<Value>>();
  auto future = promise->get_future().share();
  client->async_send_request(
      std::make_shared<typename S::Request>(std::move(request)),
      [promise, future, convert, callback](typename Client<S>::SharedFuture answer) {
        promise->set_value(convert(*answer.get()));
        if (callback) callback(future);
      });
  return future;
}

template <class Request>
Request named(const std::vector<std::string>& names) {
  Request request;
  request.names = names;
  return request;
}
template <class Request>
Request with_values(const std::vector<Parameter>& parameters) {
  Request request;
  for (const Parameter& parameter : parameters) {
    request.parameters.push_back(parameter.to_parameter_msg());
  }
  return request;
}

}  // namespace

using namespace rcl_interfaces::srv;  // NOLINT: of parameters only

struct AsyncParametersClient::Clients {
  template <class S>
  static std::shared_ptr<Client<S>> make(node_interfaces::NodeBaseInterface& base,
                                         const std::string& name, const QoS& qos,
                                         const CallbackGroup::SharedPtr& group) {
    return std::make_shared<Client<S>>(base, name, qos, group);
  }
  Clients(node_interfaces::NodeBaseInterface& base, const std::string& remote, const QoS& qos,
          const CallbackGroup::SharedPtr& group)
      : get(make<GetParameters>(base, remote + "/get_parameters", qos, group)),
        types(make<GetParameterTypes>(base, remote + "/get_parameter_types", qos, group)),
        set(make<SetParameters>(base, remote + "/set_parameters", qos, group)),
        atomically(
            make<SetParametersAtomically>(base, remote + "/set_parameters_atomically", qos, group)),
        list(make<ListParameters>(base, remote + "/list_parameters", qos, group)),
        describe(make<DescribeParameters>(base, remote + "/describe_parameters", qos, group)) {}

  const std::shared_ptr<Client<GetParameters>> get;
  const std::shared_ptr<Client<GetParameterTypes>> types;
  const std::shared_ptr<Client<SetParameters>> set;
  const std::shared_ptr<Client<SetParametersAtomically>> atomically;
  const std::shared_ptr<Client<ListParameters>> list;
  const std::shared_ptr<Client<DescribeParameters>> describe;
};

AsyncParametersClient::AsyncParametersClient(node_interfaces::NodeBaseInterface::SharedPtr base,
                                             const std::string& remote_node, const QoS& qos,
                                             CallbackGroup::SharedPtr group)
    : base_(std::move(base)),
      remote_(remote_node.empty() ? base_->get_fully_qualified_name() : remote_node),
      clients_(std::make_shared<Clients>(*base_, remote_, qos, group)) {
}

bool AsyncParametersClient::service_is_ready() const {
  return clients_->get->service_is_ready() && clients_->types->service_is_ready() &&
         clients_->set->service_is_ready() && clients_->atomically->service_is_ready() &&
         clients_->list->service_is_ready() && clients_->describe->service_is_ready();
}

std::shared_future<std::vector<Parameter>> AsyncParametersClient::get_parameters(
    const std::vector<std::string>& names, Callback<std::vector<Parameter>> callback) {
  const auto convert = [names](const GetParameters::Response& response) {
    std::vector<Parameter> parameters;
    for (std::size_t i = 0; i < std::min(names.size(), response.values.size()); ++i) {
      parameters.emplace_back(names[i], ParameterValue(response.values[i]));
    }
    return parameters;
  };
  return call(clients_->get, named<GetParameters::Request>(names), convert, std::move(callback));
}
std::shared_future<AsyncParametersClient::Descriptors> AsyncParametersClient::describe_parameters(
    const std::vector<std::string>& names, Callback<Descriptors> callback) {
  return call(
      clients_->describe, named<DescribeParameters::Request>(names),
      [](const DescribeParameters::Response& response) {
        return Descriptors(response.descriptors);
      },
      std::move(callback));
}
std::shared_future<std::vector<ParameterType>> AsyncParametersClient::get_parameter_types(
    const std::vector<std::string>& names, Callback<std::vector<ParameterType>> callback) {
  const auto convert = [](const GetParameterTypes::Response& response) {
    std::vector<ParameterType> types;
    for (const auto type : response.types) types.push_back(static_cast<ParameterType>(type));
    return types;
  };
  return call(clients_->types, named<GetParameterTypes::Request>(names), convert,
              std::move(callback));
}
std::shared_future<AsyncParametersClient::Results> AsyncParametersClient::set_parameters(
    const std::vector<Parameter>& parameters, Callback<Results> callback) {
  return call(
      clients_->set, with_values<SetParameters::Request>(parameters),
      [](const SetParameters::Response& response) { return Results(response.results); },
      std::move(callback));
}
std::shared_future<rcl_interfaces::msg::SetParametersResult>
AsyncParametersClient::set_parameters_atomically(
    const std::vector<Parameter>& parameters,
    Callback<rcl_interfaces::msg::SetParametersResult> callback) {
  return call(
      clients_->atomically, with_values<SetParametersAtomically::Request>(parameters),
      [](const SetParametersAtomically::Response& response) { return response.result; },
      std::move(callback));
}
std::shared_future<AsyncParametersClient::Results> AsyncParametersClient::delete_parameters(
    const std::vector<std::string>& names) {
  std::vector<Parameter> unset;
  for (const auto& name : names) unset.emplace_back(name);
  return set_parameters(unset);
}
std::shared_future<AsyncParametersClient::Results> AsyncParametersClient::load_parameters(
    const std::string& yaml_file) {
  const std::string node = detail::expand_name(remote_, base_->get_name(), base_->get_namespace());
  std::vector<Parameter> parameters;
  for (const detail::ParameterRule& rule : detail::parameters_from_file(yaml_file)) {
    if (detail::means_node(rule.node, node)) {
      parameters.emplace_back(rule.name, ParameterValue(rule.value));
    }
  }
  return set_parameters(parameters);
}
std::shared_future<rcl_interfaces::msg::ListParametersResult>
AsyncParametersClient::list_parameters(
    const std::vector<std::string>& prefixes, std::uint64_t depth,
    Callback<rcl_interfaces::msg::ListParametersResult> callback) {
  ListParameters::Request request;
  request.prefixes = prefixes;
  request.depth = depth;
  return call(
      clients_->list, std::move(request),
      [](const ListParameters::Response& response) { return response.result; },
      std::move(callback));
}

}  // namespace rclcpp
