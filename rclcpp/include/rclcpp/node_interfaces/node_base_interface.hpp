// The part of a node that executors know: its name, its context, its groups, and Takt's node.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__NODE_BASE_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__NODE_BASE_INTERFACE_HPP_

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "takt/nodes/node.hpp"

#include "rclcpp/callback_group.hpp"
#include "rclcpp/context.hpp"
#include "rclcpp/detail/refused.hpp"
#include "rclcpp/macros.hpp"
#include "rclcpp/node_options.hpp"

namespace rclcpp {
namespace detail {
struct Arguments;
}
namespace node_interfaces {

/// Thread safety: every method from any thread. Real-time: set-up only.
class NodeBaseInterface {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(NodeBaseInterface)

  /// `make` makes Takt's node. Throws exceptions::InvalidNodeNameError or InvalidNamespaceError,
  /// and UnknownROSArgsError or RCLInvalidROSArgsError for options.arguments().
  using MakeNode =
      std::function<std::shared_ptr<takt::Node>(const std::string&, const takt::NodeOptions&)>;
  NodeBaseInterface(const std::string& name, const std::string& name_space,
                    const NodeOptions& options, const MakeNode& make);
  ~NodeBaseInterface();
  NodeBaseInterface(const NodeBaseInterface&) = delete;
  NodeBaseInterface& operator=(const NodeBaseInterface&) = delete;

  const char* get_name() const { return node_->name().c_str(); }
  /// "/" for the root namespace.
  const char* get_namespace() const { return name_space_.c_str(); }
  const char* get_fully_qualified_name() const { return node_->fully_qualified_name().c_str(); }
  Context::SharedPtr get_context() { return options_.context(); }

  CallbackGroup::SharedPtr create_callback_group(CallbackGroupType type,
                                                 bool automatically_add_to_executor = true);
  CallbackGroup::SharedPtr get_default_callback_group() { return node_->default_callback_group(); }
  bool callback_group_in_node(CallbackGroup::SharedPtr group);
  void for_each_callback_group(const std::function<void(CallbackGroup::SharedPtr)>& function);
  std::atomic_bool& get_associated_with_executor_atomic() { return has_executor_; }
  bool get_use_intra_process_default() const { return options_.use_intra_process_comms(); }
  bool get_enable_topic_statistics_default() const { return options_.enable_topic_statistics(); }
  /// Throws exceptions::InvalidTopicNameError or InvalidServiceNameError.
  std::string resolve_topic_or_service_name(const std::string& name, bool is_service,
                                            bool only_expand = false) const;

  RCLCPP_REFUSED_(get_rcl_node_handle, "rcl's handles")
  RCLCPP_REFUSED_(get_shared_rcl_node_handle, "rcl's handles")
  // For this library.

  const NodeOptions& options() const { return options_; }
  const std::shared_ptr<takt::Node>& takt_node() const { return node_; }
  /// Sets the node's clock from /clock; nullptr: simulated time is not available.
  const std::shared_ptr<takt::SimulatedClock::Source>& time_source() const { return time_source_; }
  /// "timer_500ms", the next timer of this period "timer_500ms_2", and so on: each run of the
  /// program gives the same names.
  std::string next_timer_name(std::chrono::nanoseconds period);
  /// The values that arguments and options give to parameters of the node of this full name.
  takt::Parameters parameter_overrides(const std::string& node) const;

 private:
  std::shared_ptr<takt::Node> make_node(const std::string& name, const std::string& name_space,
                                        const MakeNode& make);
  const detail::Arguments& global() const;

  const NodeOptions options_;
  const std::unique_ptr<const detail::Arguments> own_;  // of options.arguments()
  std::shared_ptr<takt::SimulatedClock::Source> time_source_;
  std::shared_ptr<takt::Node> node_;
  std::string name_space_;
  std::atomic_bool has_executor_{false};
  std::atomic<int> groups_{0};
  std::mutex mutex_;                                // guards all below
  std::map<std::chrono::nanoseconds, int> timers_;  // number of timers by period
};

}  // namespace node_interfaces
}  // namespace rclcpp

#endif  // RCLCPP__NODE_INTERFACES__NODE_BASE_INTERFACE_HPP_
