// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/detail/qos_parameters.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/node_interfaces/node_parameters_interface.hpp"

namespace rclcpp::detail {
namespace {

template <class Policy>
struct Named {
  const char* name;
  Policy policy;
};
constexpr Named<HistoryPolicy> kHistories[] = {{"keep_last", HistoryPolicy::KeepLast},
                                               {"keep_all", HistoryPolicy::KeepAll},
                                               {"system_default", HistoryPolicy::SystemDefault}};
constexpr Named<ReliabilityPolicy> kReliabilities[] = {
    {"reliable", ReliabilityPolicy::Reliable},
    {"best_effort", ReliabilityPolicy::BestEffort},
    {"best_available", ReliabilityPolicy::BestAvailable},
    {"system_default", ReliabilityPolicy::SystemDefault}};
constexpr Named<DurabilityPolicy> kDurabilities[] = {
    {"volatile", DurabilityPolicy::Volatile},
    {"transient_local", DurabilityPolicy::TransientLocal},
    {"best_available", DurabilityPolicy::BestAvailable},
    {"system_default", DurabilityPolicy::SystemDefault}};
constexpr Named<LivelinessPolicy> kLivelinesses[] = {
    {"automatic", LivelinessPolicy::Automatic},
    {"manual_by_topic", LivelinessPolicy::ManualByTopic},
    {"system_default", LivelinessPolicy::SystemDefault}};

/// Returns the parameter of a QoS policy; declares it with an initial value unless it is declared
/// already.
class Declared {
 public:
  Declared(node_interfaces::NodeParametersInterface& parameters, std::string prefix)
      : parameters_(parameters), prefix_(std::move(prefix)) {}

  ParameterValue operator()(const std::string& policy, const ParameterValue& initial) const {
    const std::string name = prefix_ + policy;
    if (parameters_.has_parameter(name)) {
      return parameters_.get_parameter(name).get_parameter_value();
    }
    return parameters_.declare_parameter(
        name, initial, node_interfaces::ParameterDescriptor().set__read_only(true));
  }
  template <class Policy, std::size_t kCount>
  Policy operator()(const std::string& policy, Policy initial,
                    const Named<Policy> (&names)[kCount]) const {
    const auto* of_initial = std::find_if(
        names, names + kCount, [&](const auto& known) { return known.policy == initial; });
    const std::string text =
        (*this)(policy, ParameterValue(std::string(of_initial != names + kCount ? of_initial->name
                                                                                : "unknown")))
            .get<std::string>();
    for (const auto& known : names) {
      if (text == known.name) return known.policy;
    }
    throw exceptions::InvalidParameterValueException("parameter '" + prefix_ + policy +
                                                     "' cannot be '" + text + "'");
  }
  Duration operator()(const std::string& policy, const Duration& initial) const {
    return Duration::from_nanoseconds(
        (*this)(policy, ParameterValue(initial.nanoseconds())).get<std::int64_t>());
  }

 private:
  node_interfaces::NodeParametersInterface& parameters_;
  const std::string prefix_;
};

void declare(QosPolicyKind kind, const Declared& declared, QoS& qos) {
  switch (kind) {
    case QosPolicyKind::Deadline:
      qos.deadline(declared("deadline", qos.deadline()));
      break;
    case QosPolicyKind::Lifespan:
      qos.lifespan(declared("lifespan", qos.lifespan()));
      break;
    case QosPolicyKind::LivelinessLeaseDuration:
      qos.liveliness_lease_duration(
          declared("liveliness_lease_duration", qos.liveliness_lease_duration()));
      break;
    case QosPolicyKind::Depth:
      qos.get_rmw_qos_profile().depth = static_cast<std::size_t>(
          declared("depth", ParameterValue(static_cast<std::int64_t>(qos.depth())))
              .get<std::int64_t>());
      break;
    case QosPolicyKind::Durability:
      qos.durability(declared("durability", qos.durability(), kDurabilities));
      break;
    case QosPolicyKind::History:
      qos.history(declared("history", qos.history(), kHistories));
      break;
    case QosPolicyKind::Liveliness:
      qos.liveliness(declared("liveliness", qos.liveliness(), kLivelinesses));
      break;
    case QosPolicyKind::Reliability:
      qos.reliability(declared("reliability", qos.reliability(), kReliabilities));
      break;
    default:
      throw std::invalid_argument("this QoS policy cannot be overridden by a parameter");
  }
}

}  // namespace

QoS QosParameters::apply(const QoS& qos, const std::string& topic,
                         const QosOverridingOptions& options, bool is_subscription) const {
  if (options.get_policy_kinds().empty()) return qos;
  if (parameters_ == nullptr) {
    throw std::runtime_error("topic '" + topic +
                             "': its QoS cannot be overridden, as it is made of an interface "
                             "without parameters");
  }
  const std::string id = options.get_id().empty() ? "" : "_" + options.get_id();
  const Declared declared(
      *parameters_,
      "qos_overrides." + topic + "." + (is_subscription ? "subscription" : "publisher") + id + ".");
  QoS overridden = qos;
  for (const QosPolicyKind kind : options.get_policy_kinds()) declare(kind, declared, overridden);
  if (const auto& validate = options.get_validation_callback()) {
    const QosCallbackResult result = validate(overridden);
    if (!result.successful) {
      throw exceptions::InvalidParametersException("validation callback failed: " + result.reason);
    }
  }
  return overridden;
}

}  // namespace rclcpp::detail
