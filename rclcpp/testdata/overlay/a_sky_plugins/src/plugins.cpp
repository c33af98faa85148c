// What libraries that robots link ask of the layer's headers.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

// These alone give a library all that it declares: diagnostic_updater.
#include "diagnostic_msgs/msg/diagnostic_array.hpp"
#include "rclcpp/node_interfaces/node_services_interface.hpp"
#include "rclcpp/node_interfaces/node_topics_interface.hpp"

struct Library {
  rclcpp::TimerBase::SharedPtr timer;
  rclcpp::Publisher<diagnostic_msgs::msg::DiagnosticArray>::SharedPtr publisher;
  rclcpp::Subscription<diagnostic_msgs::msg::DiagnosticArray>::SharedPtr subscription;
  rclcpp::ServiceBase::SharedPtr service;
  rclcpp::ClientBase::SharedPtr client;
};

#include "libstatistics_collector/collector.hpp"
#include "rcl/arguments.h"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_components/register_node_macro.hpp"
#include "rcpputils/thread_safety_annotations.hpp"

// As hardware_interface, controller_manager and libstatistics_collector do.
static_assert(RCL_PARAM_FILE_FLAG[2] == 'p');
using Demangle = decltype(&abi::__cxa_demangle);
struct Guarded {
  std::mutex mutex;
  libstatistics_collector::Collector collector RCPPUTILS_TSA_GUARDED_BY(mutex);
};

class Plugin : public rclcpp::Node {
 public:
  explicit Plugin(const rclcpp::NodeOptions& options) : Node("plugin", options) {}
};
RCLCPP_COMPONENTS_REGISTER_NODE(Plugin)

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  Library library;
  const auto node = std::make_shared<Plugin>(rclcpp::NodeOptions());
  library.publisher =
      node->create_publisher<diagnostic_msgs::msg::DiagnosticArray>("diagnostics", 1);
  std::printf("%s %s\n", WORD, library.publisher->get_topic_name());
  rclcpp::shutdown();
}
