// The second half of supported.cpp: time, parameters, logging, executors, lifecycle and components.
// SPDX-License-Identifier: Apache-2.0
#include "elements.hpp"
#include "rclcpp/parameter_events_filter.hpp"
#include "rclcpp_components/node_factory_template.hpp"
#include "rclcpp_components/register_node_macro.hpp"
#include "rcpputils/asserts.hpp"
#include "rcpputils/endian.hpp"
#include "rcpputils/env.hpp"
#include "rcpputils/join.hpp"
#include "rcpputils/pointer_traits.hpp"
#include "rcpputils/rolling_mean_accumulator.hpp"
#include "rcpputils/shared_library.hpp"
#include "rcpputils/split.hpp"

namespace rclcpp::elements::supported_more {

// ---- Time ----

// Row: `create_wall_timer`, `create_timer`, `TimerBase` | callbacks take nothing, `TimerBase&` or
// `const TimerInfo&`; also `create_timer(node, clock, …)`, and a program's own `GenericTimer` or
// `WallTimer`, which `NodeTimersInterface::add_timer` adds to a node: before, it can do nothing
void timers(Node& node, CallbackGroup::SharedPtr group) {
  TimerBase::SharedPtr timer = node.create_wall_timer(
      std::chrono::milliseconds(1), [] {}, group);
  timer = node.create_wall_timer(
      std::chrono::seconds(1), [](TimerBase&) {}, nullptr, false);
  timer = node.create_timer(std::chrono::duration<double>(0.5), [](const TimerInfo&) {});
  timer = create_timer(&node, node.get_clock(), Duration(1, 0), [] {});
  timer = WallTimer<VoidCallbackType>::make_shared(
      std::chrono::seconds(1), [] {}, contexts::get_global_default_context());
  node.get_node_timers_interface()->add_timer(timer, nullptr);
  timer->cancel();
  timer->reset();
  if (timer->is_canceled() && timer->time_until_trigger().count() > 0) timer->is_steady();
}
template <typename... Types>
constexpr bool kNoneIsTrivial = (!std::is_trivially_destructible_v<Types> && ...);
static_assert(kNoneIsTrivial<Time, Duration, Logger, InitOptions, MessageInfo>);
// Row: `Time`, `Duration` | arithmetic, comparisons, conversions from and to messages
void times(const Node& node) {
  const Time begin = node.now(), later = begin + Duration::from_seconds(0.5);
  const Duration duration = later - begin, other = Duration(std::chrono::seconds(1)) * 0.5;
  builtin_interfaces::msg::Time stamp = later;
  stamp = stamp + duration - other;
  const builtin_interfaces::msg::Duration length = duration;
  const double seconds = (Time(stamp, RCL_ROS_TIME) - begin).seconds() + Duration(length).seconds();
  if (seconds > 0 && duration < other && later >= begin) (void)duration.nanoseconds();
  (void)duration.to_chrono<std::chrono::milliseconds>();
}
// Row: `Clock`, `Node::now`, `get_clock`, simulated time | of three kinds, also asleep:
// `sleep_for`, `sleep_until`, `wait_until_started`
void clocks(Node& node) {
  const Clock::SharedPtr clock = node.get_clock();
  clock->sleep_until(clock->now() + Duration(0, 1));
  clock->sleep_for(std::chrono::nanoseconds(1));
  clock->wait_until_started();
  if (clock->get_clock_type() == RCL_ROS_TIME) clock->ros_time_is_active();
  Clock copy(RCL_STEADY_TIME);
  copy = *clock;
  copy.now();
}
// Row: `TimeSource` | gives clocks of a program's own the time of a node
void time_source(Node::SharedPtr node) {
  TimeSource source(node);
  source.attachClock(std::make_shared<Clock>(RCL_ROS_TIME));
  source.detachNode();
  source.attachNode(node);
}
// Row: `Rate`, `WallRate` |
void rates(Clock::SharedPtr clock) {
  while (Rate(10, clock).sleep()) WallRate(std::chrono::milliseconds(1)).reset();
}

// ---- Parameters ----

// Row: `declare_parameter`, `declare_parameters`, `undeclare_parameter`, `has_parameter` | with
// ranges, read-only, of one type or any
void declarations(Node& node) {
  rcl_interfaces::msg::ParameterDescriptor descriptor;
  descriptor.read_only = true;
  const int count = node.declare_parameter("count", 1, descriptor);
  const std::string text = node.declare_parameter("text", "text");
  const auto list = node.declare_parameter("list", std::vector<double>{0.5, 1});
  const double gain = node.declare_parameter<double>("gain");
  node.declare_parameter("value", ParameterValue(true));
  node.declare_parameter("typed", ParameterType::PARAMETER_INTEGER);
  node.declare_parameters<int>("space", {{"a", count}, {"b", 2}});
  if (node.has_parameter("gain") && gain > list[0] + double(text.size())) {
    node.undeclare_parameter("gain");
  }
}
// Row: `get_parameter`, `get_parameter_or`, `get_parameters`, `list_parameters`,
// `describe_parameter` |
void reading(const Node& node) {
  double gain = node.get_parameter("gain").as_double();
  if (!node.get_parameter("gain", gain)) gain = node.get_parameter_or("gain", 0.5);
  std::map<std::string, int> counts;
  node.get_parameters("space", counts);
  node.get_parameters({"a", "b"});
  node.list_parameters({"space"}, 10);
  node.describe_parameter("gain");
}
// Row: `set_parameter`, `set_parameters`, `set_parameters_atomically`, `copy_all_parameter_values`
// |
void setting(Node& node) {
  if (!node.set_parameter({"gain", 0.5}).successful) node.set_parameters({Parameter("a", 1)});
  node.set_parameters_atomically({Parameter("a", 1), Parameter("text", "b")});
  copy_all_parameter_values(&node, &node, true);
}
// Row: `add_on_set_parameters_callback`, `add_pre_…`, `add_post_…` | a handle keeps each
void parameter_callbacks(Node& node) {
  const auto on = node.add_on_set_parameters_callback(
      [](const std::vector<Parameter>&) { return rcl_interfaces::msg::SetParametersResult(); });
  const auto pre = node.add_pre_set_parameters_callback([](std::vector<Parameter>&) {});
  const auto post = node.add_post_set_parameters_callback([](const std::vector<Parameter>&) {});
  node.remove_on_set_parameters_callback(on.get());
}
// Row: `Parameter`, `ParameterValue`, `ParameterType`, their exceptions |
void parameter_values(const Parameter& parameter) {
  try {
    if (parameter.get_type() == PARAMETER_INTEGER) (void)parameter.as_int();
    (void)parameter.get_value<std::vector<std::string>>().size();
    (void)parameter.get_parameter_value().get<ParameterType::PARAMETER_BOOL>();
    const std::string text = parameter.get_name() + parameter.value_to_string();
  } catch (const exceptions::InvalidParameterTypeException&) {
  } catch (const exceptions::ParameterNotDeclaredException&) {
  } catch (const ParameterTypeException&) {
  }
}
// Row: `AsyncParametersClient`, `SyncParametersClient` |
void parameter_clients(Node::SharedPtr node) {
  SyncParametersClient client(node, "other");
  client.wait_for_service(std::chrono::seconds(1));
  double gain = client.get_parameter<double>("gain") + client.get_parameter("gain", 0.5);
  client.set_parameters({Parameter("gain", gain)});
  const auto async = std::make_shared<AsyncParametersClient>(node, "other");
  async->get_parameters({"gain"}, [&](std::shared_future<std::vector<Parameter>> answer) {
    gain = answer.get()[0].as_double();
  });
  async->list_parameters({}, 10);
}
// Row: `ParameterEventHandler`, `ParameterEventsFilter` |
void parameter_events(Node::SharedPtr node,
                      std::shared_ptr<const rcl_interfaces::msg::ParameterEvent> received) {
  ParameterEventHandler handler(node);
  const auto of_one = handler.add_parameter_callback(
      "gain", [](const Parameter&) {}, "other");
  const auto of_all =
      handler.add_parameter_event_callback([](const rcl_interfaces::msg::ParameterEvent& event) {
        ParameterEventHandler::get_parameters_from_event(event);
      });
  using Filter = ParameterEventsFilter;
  const Filter filter(received, {"gain"}, {Filter::EventType::NEW, Filter::EventType::CHANGED});
  if (!filter.get_events().empty()) Parameter::from_parameter_msg(*filter.get_events()[0].second);
}

// ---- Logging ----

// Row: `Logger`, `get_logger`, its levels and children | to stderr and to `/rosout`;
// `RCUTILS_CONSOLE_OUTPUT_FORMAT`, `RCUTILS_COLORIZED_OUTPUT`, `RCUTILS_LOGGING_USE_STDOUT` and
// `--log-level`
void loggers() {
  Logger logger = get_logger("name").get_child("child");
  logger.set_level(Logger::Level::Debug);
  if (logger.get_effective_level() == Logger::Level::Info) logger.get_name();
}
// Row: `RCLCPP_INFO` and the other levels, `_STREAM`, `_ONCE`, `_THROTTLE`, `_EXPRESSION`,
// `_FUNCTION`, `_SKIPFIRST` and what these can be combined to |
void lines(const Node& node, Clock& clock) {
  RCLCPP_DEBUG(node.get_logger(), "%d", 1);
  RCLCPP_INFO_STREAM(node.get_logger(), "a" << 1);
  RCLCPP_WARN_ONCE(node.get_logger(), "a");
  RCLCPP_ERROR_THROTTLE(node.get_logger(), clock, 1000, "%s", "a");
  RCLCPP_FATAL_STREAM_THROTTLE(node.get_logger(), clock, 1000, "a" << 1);
  RCLCPP_INFO_EXPRESSION(node.get_logger(), true, "a");
  RCLCPP_INFO_FUNCTION(
      node.get_logger(), [] { return true; }, "a");
  RCLCPP_INFO_SKIPFIRST_THROTTLE(node.get_logger(), clock, 1000, "a");
  RCUTILS_LOG_INFO("%d", 1);
  RCUTILS_LOG_WARN_THROTTLE(RCUTILS_STEADY_TIME, 1000, "%s", "a");
}

// ---- Executors ----

// Row: `spin`, `spin_some`, `spin_all`, `spin_until_future_complete` | each throws for a node that
// belongs to an executor
void spins(Node::SharedPtr node, std::shared_future<void> future) {
  spin(node);
  spin(node->get_node_base_interface());
  spin_some(node);
  spin_all(node, std::chrono::seconds(1));
  if (spin_until_future_complete(node, future, std::chrono::seconds(1)) !=
      FutureReturnCode::SUCCESS) {
    executors::SingleThreadedExecutor executor;
    executors::spin_node_until_future_complete(executor, node, future);
  }
}
// Row: `SingleThreadedExecutor`, `MultiThreadedExecutor`, `EventsExecutor`, `EventsCBGExecutor` |
// Takt's `single_threaded`, `multi_threaded` and `events`; of each the whole interface of
// `Executor`
template <class E>
void uses(Node::SharedPtr node, CallbackGroup::SharedPtr group) {
  const std::shared_ptr<Executor> executor = std::make_shared<E>(ExecutorOptions());
  executor->add_node(node);
  executor->add_callback_group(group, node->get_node_base_interface());
  executor->spin();
  executor->spin_once(std::chrono::seconds(1));
  executor->spin_some(std::chrono::seconds(1));
  executor->spin_all(std::chrono::seconds(1));
  executor->spin_node_some(node);
  if (executor->is_spinning()) executor->cancel();
  executor->remove_callback_group(group);
  executor->remove_node(node);
}
template void uses<executors::SingleThreadedExecutor>(Node::SharedPtr, CallbackGroup::SharedPtr);
template void uses<executors::MultiThreadedExecutor>(Node::SharedPtr, CallbackGroup::SharedPtr);
template void uses<executors::EventsCBGExecutor>(Node::SharedPtr, CallbackGroup::SharedPtr);
template void uses<experimental::executors::EventsExecutor>(Node::SharedPtr,
                                                            CallbackGroup::SharedPtr);
// Row: `create_callback_group`, `CallbackGroupType`, `CallbackGroup` |
void groups(Node& node) {
  const CallbackGroup::SharedPtr group =
      node.create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  if (group->type() == CallbackGroupType::Reentrant) group->automatically_add_to_executor();
}
// Row: `WaitSet`, `ThreadSafeWaitSet`, `StaticWaitSet`, `GuardCondition` | without waitables and
// events
void wait_sets(SubscriptionBase::SharedPtr subscription, TimerBase::SharedPtr timer) {
  const auto guard = std::make_shared<GuardCondition>();
  WaitSet set({{subscription}}, {guard}, {timer});
  guard->trigger();
  if (set.wait(std::chrono::seconds(1)).kind() == WaitResultKind::Ready) {
    (void)set.get_rcl_wait_set().subscriptions.size();
  }
  ThreadSafeWaitSet().add_guard_condition(guard);
  StaticWaitSet<2, 0, 0, 0, 0, 0>({{{subscription}, {subscription}}}).wait();
}

// ---- Lifecycle and components ----

// Row: `rclcpp_lifecycle`: `LifecycleNode`, `LifecyclePublisher`, managed entities, `State`,
// `Transition` | with the services and the topic that `ros2 lifecycle` uses; only publishers are
// managed, as in rclcpp
struct Managed : rclcpp_lifecycle::LifecycleNode {
  explicit Managed(const NodeOptions& options) : LifecycleNode("name", options) {}
  CallbackReturn on_configure(const rclcpp_lifecycle::State&) override {
    publisher = create_publisher<String>("topic", 10);
    return CallbackReturn::SUCCESS;
  }
  CallbackReturn on_activate(const rclcpp_lifecycle::State& state) override {
    return LifecycleNode::on_activate(state);
  }
  void move() {
    configure();
    trigger_transition(lifecycle_msgs::msg::Transition::TRANSITION_ACTIVATE);
    if (get_current_state().label() == "active" && publisher->is_activated()) deactivate();
  }
  rclcpp_lifecycle::LifecyclePublisher<String>::SharedPtr publisher;
};
static_assert(rcpputils::is_pointer<std::shared_ptr<int>&>::value &&
              !rcpputils::is_pointer<int>::value &&
              std::is_same_v<rcpputils::remove_pointer<const std::unique_ptr<int>&>::type, int> &&
              std::is_same_v<rcpputils::remove_pointer<const int*>::type, const int>);
// Row: `rcpputils::SharedLibrary`, `get_platform_library_name`, `join`, `split`,
// `get_env_var`, `is_pointer`, `remove_pointer`, `RollingMeanAccumulator`, `require_true`,
// `check_true`, `assert_true`, `endian` |
void libraries() {
  rcpputils::RollingMeanAccumulator<double> mean(3);
  mean.accumulate(mean.getRollingMean());
  rcpputils::SharedLibrary library(rcpputils::get_platform_library_name("name"));
  if (library.has_symbol(rcpputils::get_env_var("a")))
    library.get_symbol(rcpputils::join(rcpputils::split("1/2", '/'), "_"));
  library.unload_library();
  rcpputils::require_true(rcpputils::endian::native == rcpputils::endian::little);
}
// Row: `RCLCPP_COMPONENTS_REGISTER_NODE`, `NodeFactory`, `NodeInstanceWrapper` | a component of
// Takt's containers: `takt run` loads it
void components() {
  const std::shared_ptr<rclcpp_components::NodeFactory> factory =
      std::make_shared<rclcpp_components::NodeFactoryTemplate<Managed>>();
  factory->create_node_instance(NodeOptions()).get_node_base_interface();
}

}  // namespace rclcpp::elements::supported_more
