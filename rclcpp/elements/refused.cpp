// Elements of rclcpp that do not compile: each row of the table in docs/reference/rclcpp.md, and
// below it code that the compiler must refuse, with the name of that page in the error.
// elements_test.py checks the errors.
// SPDX-License-Identifier: Apache-2.0
#include "elements.hpp"

// Row: generic clients | `takt::Node::create_client` of the service's type
#include "rclcpp/create_generic_client.hpp"
#include "rclcpp/generic_client.hpp"
void generic_client(rclcpp::Node& node) {
  node.create_generic_client("service", "std_srvs/srv/Empty");
}
// Row: type support by name: `get_typesupport_library`, `get_typesupport_handle` | types that are
// linked in have names: `create_generic_subscription`
#include "rclcpp/typesupport_helpers.hpp"
void type_support() {
  rclcpp::get_typesupport_library("std_msgs/msg/String", "rosidl_typesupport_cpp");
}
// Row: `ParameterMap`, `ParameterService` | `AsyncParametersClient::load_parameters`; every node
// has its services
#include "rclcpp/parameter_map.hpp"
#include "rclcpp/parameter_service.hpp"
void parameters(rclcpp::ParameterService& service) {
  rclcpp::parameter_map_from_yaml_file("file.yaml");
}
// Row: `MessagePoolMemoryStrategy` | pools of Takt: `loans` of `takt::PublisherOptions`
#include "rclcpp/strategies/message_pool_memory_strategy.hpp"
rclcpp::strategies::message_pool_memory_strategy::MessagePoolMemoryStrategy<int, 1> pool;
// Row: `experimental::buffers` | messages inside a process always go by pointer
#include "rclcpp/experimental/buffers/intra_process_buffer.hpp"
rclcpp::experimental::buffers::IntraProcessBuffer<int> buffer;
// Row: `Waitable`, `add_waitable` | `takt::Node::create_guard_condition`, `create_file_descriptor`
#include "rclcpp/waitable.hpp"
class Waits : public rclcpp::Waitable {};
void waitables(rclcpp::Node& node, rclcpp::WaitSet& set) {
  node.get_node_waitables_interface()->add_waitable(nullptr, nullptr);
  set.add_waitable(nullptr);
}
// Row: `rclcpp_components::ComponentManager` | `takt run`, and the services of its containers
#include "rclcpp_components/component_manager.hpp"
auto manager = std::make_shared<rclcpp_components::ComponentManager>();
// Row: `class_loader` for other classes than components, in a workspace without its source | its
// [source](https://github.com/ros/class_loader) beside the package
#include "class_loader/class_loader.hpp"
void class_loader_of_others(class_loader::ClassLoader& loader) {
  loader.createInstance<rclcpp::Node>("name");
}
// Row: `SerializedMessage::release_rcl_serialized_message` | copy the bytes
void release(rclcpp::SerializedMessage& message) {
  message.release_rcl_serialized_message();
}
// Row: `QoS::avoid_ros_namespace_conventions` |
void conventions(rclcpp::QoS& qos) {
  qos.avoid_ros_namespace_conventions(true);
}
// Row: events: incompatible type |
void events(rclcpp::PublisherOptions& options) {
  options.event_callbacks.incompatible_type_callback = [](int&) {};
}
// Row: `rclcpp_action::Client::stop_callbacks` | drop what the callbacks use by a `weak_ptr`
void stop_callbacks(rclcpp_action::Client<rclcpp::elements::Fibonacci>& client) {
  client.stop_callbacks(nullptr);
}
// Row: `get_publisher_handle` and the other handles of rcl | what is needed of them is in the
// classes
void handles(rclcpp::PublisherBase& publisher, rclcpp::Context& context) {
  publisher.get_publisher_handle();
  context.get_rcl_context();
}
// Row: `PublisherBase::get_gid` | `rmw_message_info_t::publisher_gid` is a number of the publisher
void gid(rclcpp::PublisherBase& publisher) {
  publisher.get_gid();
}
// Row: `set_on_new_message_callback` and its kin | an executor of Takt's, which has its own
void on_new(rclcpp::SubscriptionBase& subscription) {
  subscription.set_on_new_message_callback([](std::size_t) {});
}
// Row: `Event`, `get_graph_event`, `wait_for_graph_change` | callbacks for matched events
void graph_events(rclcpp::Node& node) {
  rclcpp::Event::SharedPtr event;
  node.wait_for_graph_change(event, std::chrono::seconds(1));
}
