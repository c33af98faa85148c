// Differences from rclcpp: each row of the table in docs/reference/rclcpp.md, and below it code
// that compiles nevertheless. Other tests check the differences that a program can see.
// SPDX-License-Identifier: Apache-2.0
#include "elements.hpp"
#include "rclcpp/allocator/allocator_common.hpp"
#include "rclcpp/memory_strategies.hpp"

namespace rclcpp::elements::differs {

// ---- Has no effect ----

// Row: `use_intra_process_comms` | messages inside a process always go by pointer; `keep_all` with
// it is allowed: 16,384 messages
void intra_process() {
  NodeOptions().use_intra_process_comms(false);
}
// Row: allocators of messages: `PublisherOptionsWithAllocator<A>`,
// `SubscriptionOptionsWithAllocator`, `MessageMemoryStrategy`, `AllocRebind`, `Deleter` |
// deprecated: Takt allocates messages itself, and sends a copy of those that have another deleter
template <class T>
struct Own : std::allocator<T> {};
void allocators(Node& node) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  using Deleter = allocator::Deleter<Own<String>, String>;
  const PublisherOptionsWithAllocator<Own<void>> options;
  node.create_publisher<String>("topic", 10, options)->publish(std::unique_ptr<String, Deleter>());
  using Strategy = message_memory_strategy::MessageMemoryStrategy<String>;
  node.create_subscription<String>(
      "topic", 10, [](const String&) {}, SubscriptionOptions(), std::make_shared<Strategy>());
#pragma GCC diagnostic pop
}
// Row: `ExecutorOptions::memory_strategy`, `max_conditions`; `yield_before_execute`, `timeout` of
// pools | no effect: Takt's executors have their own
void executor_options() {
  ExecutorOptions options;
  options.memory_strategy = memory_strategies::create_default_strategy();
  options.max_conditions = 10;
  executors::MultiThreadedExecutor(options, 2, true, std::chrono::seconds(1));
}
// Row: content filters | `is_cft_enabled()` is false and messages come unfiltered, as over a
// middleware without them
void content_filters(Subscription<String>& subscription) {
  if (subscription.is_cft_enabled()) subscription.set_content_filter("data = %0", {"'a'"});
}
// Row: `require_unique_network_flow_endpoints`, `get_network_flow_endpoints` | no effect, and
// throws `RCLError`, as over a middleware without them
void network_flows(SubscriptionOptions& options, PublisherBase& publisher) {
  options.require_unique_network_flow_endpoints =
      RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_OPTIONALLY_REQUIRED;
  publisher.get_network_flow_endpoints();
}
// Row: `ignore_local_publications` | no effect
void local_publications(SubscriptionOptions& options) {
  options.ignore_local_publications = true;
}
// Row: `NodeOptions`: `start_parameter_event_publisher` (it comes with the services),
// `use_clock_thread` (always), `clock_qos`, `parameter_event_qos` | no effect
void node_options(NodeOptions& options) {
  options.start_parameter_event_publisher(false).use_clock_thread(false).clock_qos(QoS(1));
  options.parameter_event_qos(QoS(1));
}
// Row: `RCUTILS_LOGGING_BUFFERED_STREAM`, `--log-config-file`, `--enable-stdout-logs` and the like
// | no effect
void log_arguments() {
  NodeOptions().arguments({"--ros-args", "--disable-stdout-logs"});
}
// Row: the QoS and the thread of a `TimeSource` | those of the context, which follows `/clock` once
// for all its nodes
void time_sources() {
  (void)TimeSource(ClockQoS(), false).get_use_clock_thread();
}

// ---- Does something else ----

// Row: service introspection | `configure_introspection` is deprecated, and throws `RCLError`
// unless it is to be off
void introspection(ServiceBase& service, ClientBase& client, Clock::SharedPtr clock) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  service.configure_introspection(clock, QoS(1), RCL_SERVICE_INTROSPECTION_OFF);
  client.configure_introspection(clock, QoS(1), RCL_SERVICE_INTROSPECTION_OFF);
#pragma GCC diagnostic pop
}
// Row: `NodeOptions::enable_logger_service` | its services know the loggers that the program has
void logger_service(NodeOptions& options) {
  options.enable_logger_service(true);
}
// Row: `use_sim_time` of a node whose `NodeOptions::clock_type` is not `RCL_ROS_TIME` | has no
// effect; rclcpp throws
void clock_type(NodeOptions& options) {
  options.clock_type(RCL_SYSTEM_TIME);
}
// Row: `StaticSingleThreadedExecutor` | the same as `SingleThreadedExecutor`
void static_executor(Node::SharedPtr node) {
  executors::StaticSingleThreadedExecutor().add_node(node);
}
// Row: a callback group that nobody holds | stays as long as its entities
void group(Node& node) {
  node.create_callback_group(CallbackGroupType::Reentrant);
}
// Row: `Client` | at most 1,000 calls wait for an answer; the next one throws
void calls(Client<AddTwoInts>& client) {
  client.async_send_request(std::make_shared<AddTwoInts::Request>());
}
// Row: action servers and clients | at most 100 goals at a time
void goals(rclcpp_action::Client<Fibonacci>& client) {
  client.async_send_goal(Fibonacci::Goal());
}
// Row: `declare_parameter` | returns the value, not a reference to it
void declaration(Node& node) {
  const ParameterValue& value = node.declare_parameter("value", ParameterValue(1));
  (void)value;
}
// Row: a timer's period of 0 | is one of 1 ns
void period(Node& node) {
  node.create_wall_timer(std::chrono::seconds(0), [] {});
}
// Row: `TimerInfo` | both times are that of the call
void timer_info(Node& node) {
  node.create_wall_timer(std::chrono::seconds(1), [](const TimerInfo& info) {
    return void(info.actual_call_time - info.expected_call_time);
  });
}
// Row: `Clock::create_jump_callback` | calls on a thread of its own, after the jump: the first
// callback right before the second
void jumps(Clock& clock) {
  const auto handler =
      clock.create_jump_callback([] {}, [](const rcl_time_jump_t&) {}, {true, {1}, {-1}});
}
// Row: BEST_AVAILABLE | a subscription asks for what every publisher offers, a publisher offers
// reliable and volatile
void best_available(Node& node) {
  node.create_publisher<String>("topic", BestAvailableQoS());
}
// Row: `spin_until_future_complete` of a future that another thread completes | returns at most
// 10 ms later; in rclcpp, when something else comes
void late_future(Executor& executor, std::shared_future<void> future) {
  executor.spin_until_future_complete(future);
}
// Row: `LifecycleNode::get_current_state` during a transition | is the transition's state
void lifecycle(const rclcpp_lifecycle::LifecycleNode& node) {
  node.get_current_state().label();
}
// Row: dropping a subscription, timer, service or client while its callback may run | waits until
// that has ended, 100 ms at most; rclcpp does not wait
void drops(TimerBase::SharedPtr& timer) {
  timer.reset();
}
// Row: the reason why a parameter is not set | Takt's own sentence, which says what to do
std::string reason(Node& node) {
  return node.set_parameter(Parameter("name", 1)).reason;
}
// Row: the service `get_type_description` of each node, and the parameters
// `start_type_description_service` and `qos_overrides./parameter_events.publisher.…` | are not
// there
bool describes_types(const Node& node) {
  return node.has_parameter("start_type_description_service");
}

}  // namespace rclcpp::elements::differs
