// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/node.hpp"

namespace rclcpp {
namespace detail {

using namespace node_interfaces;  // NOLINT: of this layer's own

NodeApi::NodeApi(const std::string& name, const std::string& name_space, const NodeOptions& options,
                 const NodeBaseInterface::MakeNode& make)
    : base_(std::make_shared<NodeBaseInterface>(name, name_space, options, make)),
      clock_(std::make_shared<NodeClockInterface>(*base_)),
      graph_(std::make_shared<NodeGraphInterface>(base_)),
      logging_(std::make_shared<NodeLoggingInterface>(*base_)),
      parameters_(std::make_shared<NodeParametersInterface>(base_)),
      services_(std::make_shared<NodeServicesInterface>(base_)),
      time_source_(std::make_shared<NodeTimeSourceInterface>(base_)),
      timers_(std::make_shared<NodeTimersInterface>(base_)),
      topics_(std::make_shared<NodeTopicsInterface>(base_)),
      type_descriptions_(std::make_shared<NodeTypeDescriptionsInterface>(base_)),
      waitables_(std::make_shared<NodeWaitablesInterface>(base_)) {
}
NodeApi::NodeApi(const NodeApi& other, const std::string& sub)
    : base_(other.base_),
      clock_(other.clock_),
      graph_(other.graph_),
      logging_(other.logging_),
      parameters_(other.parameters_),
      services_(other.services_),
      time_source_(other.time_source_),
      timers_(other.timers_),
      topics_(other.topics_),
      type_descriptions_(other.type_descriptions_),
      waitables_(other.waitables_),
      sub_(other.sub_.empty() ? sub : other.sub_ + "/" + sub) {
  if (sub.empty() || sub[0] == '/') {
    throw exceptions::NameValidationError("sub_namespace", sub.c_str(),
                                          "a sub-namespace must be a relative name", 0);
  }
}

}  // namespace detail

Node::Node(const std::string& name, const std::string& name_space, const NodeOptions& options)
    : NodeApi(name, name_space, options,
              [](const std::string& in_code, const takt::NodeOptions& how) {
                return std::make_shared<takt::Node>(in_code, how);
              }) {
}
Node::~Node() = default;

Node::SharedPtr Node::create_sub_node(const std::string& name_space) {
  struct Sub : Node {
    Sub(const Node& other, const std::string& sub) : Node(other, sub) {}
  };
  return std::make_shared<Sub>(*this, name_space);
}

}  // namespace rclcpp
