// Elements of rclcpp that work as in rclcpp: each row of the table in docs/reference/rclcpp.md, and
// below it code that must compile. Nothing calls this code: other tests check what it does.
// SPDX-License-Identifier: Apache-2.0
#include "elements.hpp"

// Names of other headers, the last of a line in named_headers.cmake, too.
#include "rclcpp/create_service.hpp"
#include "rclcpp/executor_options.hpp"
#include "rclcpp/executors/multi_threaded_executor.hpp"
#include "rclcpp/node_interfaces/get_node_base_interface.hpp"

namespace rclcpp::elements::supported {

// ---- A program ----

// Row: `init`, `shutdown`, `ok`, `sleep_for`, `on_shutdown` | `--ros-args` with remaps, parameters,
// files of parameters and levels of logging; SIGINT and SIGTERM shut every context down, and wake
// whatever waits
void program(int argc, char** argv) {
  init(argc, argv);
  on_shutdown([] {});
  while (ok()) sleep_for(std::chrono::milliseconds(1));
  shutdown();
}
// Row: `init_and_remove_ros_arguments`, `remove_ros_arguments` |
void arguments(int argc, char** argv) {
  std::vector<std::string> own = init_and_remove_ros_arguments(argc, argv);
  own = remove_ros_arguments(argc, argv);
}
// Row: `InitOptions`, `SignalHandlerOptions`, `install_signal_handlers` |
void init_options(int argc, char** argv) {
  InitOptions options;
  options.shutdown_on_signal = false;
  options.auto_initialize_logging(true).set_domain_id(1);
  init(argc, argv, options, SignalHandlerOptions::None);
  install_signal_handlers(SignalHandlerOptions::SigInt);
  uninstall_signal_handlers();
}
// Row: `Context`, `contexts::get_global_default_context` | several in a process, too
void contexts_of_one_process() {
  const auto context = std::make_shared<Context>();
  context->init(0, nullptr);
  context->add_pre_shutdown_callback([] {});
  context->add_on_shutdown_callback([] {});
  if (context->is_valid()) context->shutdown("its reason");
  contexts::get_global_default_context()->get_init_options();
}

// ---- Nodes ----

// Row: `Node`, its constructors, `make_shared`, names | deriving from it, too
struct Derived : Node {
  using Node::Node;
  explicit Derived(const NodeOptions& options) : Node("name", "/space", options) {}
};
void nodes() {
  const auto node = Node::make_shared("name");
  const Node::SharedPtr derived = std::make_shared<Derived>(NodeOptions());
  const char* const names[] = {node->get_name(), node->get_namespace(),
                               node->get_fully_qualified_name()};
  (void)names;
}
// Row: `NodeOptions` | those of the table below have no effect
void node_options() {
  NodeOptions options;
  options.context(contexts::get_global_default_context())
      .arguments({"--ros-args", "-r", "a:=b"})
      .parameter_overrides({Parameter("count", 1)})
      .append_parameter_override("gain", 0.5)
      .use_global_arguments(true)
      .use_intra_process_comms(true)
      .clock_type(RCL_STEADY_TIME)
      .enable_rosout(false)
      .start_parameter_services(false)
      .allow_undeclared_parameters(true)
      .automatically_declare_parameters_from_overrides(true);
}
// Row: `get_node_base_interface()` and the other interfaces of a node, also by
// `node_interfaces::get_node_…_interface(node)` | from nodes of any class, and in a constructor
template <class N>
void interfaces(N node) {
  node->get_node_base_interface()->get_default_callback_group();
  node->get_node_clock_interface()->get_clock();
  node->get_node_graph_interface()->count_publishers("topic");
  node->get_node_logging_interface()->get_logger();
  node->get_node_parameters_interface()->has_parameter("name");
  node->get_node_services_interface();
  node->get_node_time_source_interface();
  node->get_node_timers_interface();
  const auto topics = node->get_node_topics_interface();
  topics->resolve_topic_name("topic");
  create_publisher<String>(topics, "topic", 10);
  create_subscription<String>(topics, "topic", 10, [](const String&) {});
  node->get_node_waitables_interface();
  node_interfaces::get_node_base_interface(node);
  node_interfaces::get_node_parameters_interface(*node);
}
template void interfaces(Node::SharedPtr);
template void interfaces(Node*);
template void interfaces(rclcpp_lifecycle::LifecycleNode::SharedPtr);
// Row: `NodeInterfaces<…>` | made of a node of any class
void some_interfaces(Node& node) {
  using namespace node_interfaces;  // NOLINT(google-build-using-namespace): as programs write it
  const NodeInterfaces<NodeBaseInterface, NodeTopicsInterface> some(node);
  some.get_node_base_interface()->get_name();
  some.get<NodeTopicsInterface>()->resolve_topic_name("topic");
  const NodeInterfaces<NodeBaseInterface> one(some.get_node_base_interface());
}
// Row: `create_sub_node`, `expand_topic_or_service_name`, `resolve_topic_or_service_name` |
void names(Node& node) {
  node.create_sub_node("left")->get_effective_namespace();
  std::string name = expand_topic_or_service_name("~/topic", "node", "/space", false);
  name = node.get_node_base_interface()->resolve_topic_or_service_name("topic", false);
}
// Row: queries of the graph: names and types, counts, `get_publishers_info_by_topic` |
std::size_t graph(const Node& node) {
  std::map<std::string, std::vector<std::string>> types = node.get_topic_names_and_types();
  types = node.get_service_names_and_types();
  std::vector<std::string> nodes = node.get_node_names();
  std::size_t count = node.count_publishers("topic") + node.count_subscribers("topic");
  count += node.count_clients("service") + node.count_services("service");
  for (const TopicEndpointInfo& info : node.get_publishers_info_by_topic("topic")) {
    count += info.qos_profile().depth() + info.node_name().size() + info.topic_type().size() +
             info.topic_type_hash().version;
  }
  return count;
}

// ---- Messages ----

// Row: `create_publisher`, `Publisher`, `PublisherOptions` | also `create_publisher(node, …)`
std::size_t publishers(Node& node) {
  PublisherOptions options;
  options.use_intra_process_comm = IntraProcessSetting::Enable;
  const Publisher<String>::SharedPtr publisher = node.create_publisher<String>("t", 10, options);
  publisher->publish(String());
  publisher->publish(std::make_unique<String>());
  const PublisherBase::SharedPtr base = create_publisher<String>(node, "topic", QoS(1));
  std::size_t count = base->get_subscription_count() + base->get_intra_process_subscription_count();
  count += base->get_actual_qos().depth() + base->get_queue_size();
  base->wait_for_all_acked(std::chrono::seconds(1));
  if (base->get_topic_name() != nullptr) base->assert_liveliness();
  return count;
}
// Row: `borrow_loaned_message`, `LoanedMessage` | not in shared memory; from a pool
void loans(Publisher<String>& publisher) {
  LoanedMessage<String> loan = publisher.borrow_loaned_message();
  loan.get().data = "text";
  publisher.publish(std::move(loan));
}
// Row: `create_subscription`, `Subscription`, `SubscriptionOptions` | callbacks take `const M&`,
// `shared_ptr<const M>`, `shared_ptr<M>`, `unique_ptr<M>`, the same of an adapted type, or of
// `SerializedMessage`; each with or without `const MessageInfo&`; also by `std::bind`
struct Listener : Node {
  using Node::Node;
  void take(String::SharedPtr) {}
  void inform(const String&, const MessageInfo&) const {}
  void listen() {
    using std::placeholders::_1;
    using std::placeholders::_2;
    SubscriptionOptions options;
    options.callback_group = create_callback_group(CallbackGroupType::Reentrant);
    SubscriptionBase::SharedPtr any =
        create_subscription<String>("t", 10, std::bind(&Listener::take, this, _1), options);
    any = create_subscription<String>("t", 10, std::bind(&Listener::inform, this, _1, _2));
    any = create_subscription<String>("t", SensorDataQoS(), [](String::ConstSharedPtr) {});
    any = create_subscription<String>("t", 1, [](const String::ConstSharedPtr&) {});
    any = create_subscription<String>("t", 1, [](String::UniquePtr) {});
    any = create_subscription<String>("t", 1, [](const SerializedMessage&) {});
    any = rclcpp::create_subscription<String>(*this, "t", 1, [](const String&) {});
    if (any->get_publisher_count() != 0) any->get_topic_name();
  }
};
// Row: `Subscription::take`, `take_serialized`, `handle_message`, `MessageInfo` |
void taking(Subscription<String>& subscription) {
  String message;
  MessageInfo info;
  SerializedMessage bytes;
  subscription.take(message, info);
  subscription.take_serialized(bytes, info);
  if (!info.get_rmw_message_info().from_intra_process) subscription.get_actual_qos();
}
// Row: `SerializedMessage`, `Serialization` | CDR
void serialized(Publisher<String>& publisher) {
  SerializedMessage bytes(100);
  String message;
  Serialization<String>().serialize_message(&message, &bytes);
  Serialization<String>().deserialize_message(&bytes, &message);
  publisher.publish(bytes);
  if (bytes.size() <= bytes.capacity()) bytes.get_rcl_serialized_message();
}
// Row: `TypeAdapter`, `adapt_type`, `RCLCPP_USING_CUSTOM_TYPE_AS_ROS_MESSAGE_TYPE` |
void adapted(Node& node) {
  using Text = adapt_type<std::string>::as<String>;
  node.create_publisher<Text>("topic", 10)->publish(std::string("text"));
  node.create_subscription<Text>("topic", 10, [](const std::string&) {});
}
// Row: `create_generic_publisher`, `create_generic_subscription` | of every type that is linked in
void generic(Node& node, const SerializedMessage& bytes) {
  const GenericPublisher::SharedPtr publisher =
      node.create_generic_publisher("topic", "std_msgs/msg/String", 10);
  if (publisher->get_subscription_count() + publisher->get_intra_process_subscription_count() > 0) {
    publisher->publish(bytes);
  }
  const GenericSubscription::SharedPtr subscription = node.create_generic_subscription(
      "topic", "std_msgs/msg/String", QoS(10), [](std::shared_ptr<const SerializedMessage>) {});
}
// Row: `wait_for_message` |
void waits_for_message(Node::SharedPtr node) {
  String message;
  wait_for_message(message, node, "topic", std::chrono::seconds(1));
}
// Row: `QoS`, its setters and presets, `rmw_qos_profile_t` |
void qos() {
  QoS qos = QoS(KeepLast(5)).reliable().transient_local().deadline(std::chrono::seconds(1));
  qos.keep_all().best_effort().durability_volatile().lifespan(Duration(1, 0));
  qos.liveliness(LivelinessPolicy::Automatic).liveliness_lease_duration(Duration(1, 0));
  qos.history(HistoryPolicy::KeepLast).reliability(ReliabilityPolicy::Reliable);
  for (const QoS& preset :
       {QoS(SensorDataQoS()), QoS(SystemDefaultsQoS()), QoS(ServicesQoS()), QoS(ParametersQoS()),
        QoS(ParameterEventsQoS()), QoS(RosoutQoS()), QoS(ClockQoS()), QoS(BestAvailableQoS())}) {
    const rmw_qos_profile_t& profile = preset.get_rmw_qos_profile();
    qos = QoS(QoSInitialization::from_rmw(profile), profile);
  }
}
// Row: `QosOverridingOptions` |
void qos_overrides(Node& node) {
  SubscriptionOptions options;
  options.qos_overriding_options = QosOverridingOptions::with_default_policies();
  node.create_subscription<String>(
      "topic", 10, [](const String&) {}, options);
}
// Row: topic statistics: `SubscriptionOptions::topic_stats_options`,
// `NodeOptions::enable_topic_statistics` | age and period of the messages, as
// `statistics_msgs/msg/MetricsMessage`
void statistics(NodeOptions& of_all, SubscriptionOptions& options) {
  of_all.enable_topic_statistics(true);
  options.topic_stats_options.state = TopicStatisticsState::Enable;
  options.topic_stats_options.publish_topic = "/statistics";
  options.topic_stats_options.publish_period = std::chrono::seconds(1);
}
// Row: callbacks for events: matched, deadline, liveliness, incompatible QoS, lost messages |
void events(SubscriptionOptions& subscription, PublisherOptions& publisher) {
  subscription.event_callbacks.deadline_callback = [](QOSDeadlineRequestedInfo&) {};
  subscription.event_callbacks.liveliness_callback = [](QOSLivelinessChangedInfo&) {};
  subscription.event_callbacks.message_lost_callback = [](QOSMessageLostInfo&) {};
  publisher.event_callbacks.matched_callback = [](MatchedInfo&) {};
  publisher.event_callbacks.liveliness_callback = [](QOSLivelinessLostInfo&) {};
  publisher.event_callbacks.deadline_callback = [](QOSDeadlineOfferedInfo&) {};
  publisher.event_callbacks.incompatible_qos_callback = [](QOSOfferedIncompatibleQoSInfo&) {};
}

// ---- Services and actions ----

// Row: `create_service`, `Service`, `send_response` | with and without the header of the request;
// answers may come later
void services(Node& node) {
  using Request = std::shared_ptr<AddTwoInts::Request>;
  using Response = std::shared_ptr<AddTwoInts::Response>;
  using Header = std::shared_ptr<rmw_request_id_t>;
  using Self = Service<AddTwoInts>::SharedPtr;
  Self service = node.create_service<AddTwoInts>("s", [](const Request, Response) {});
  service = node.create_service<AddTwoInts>("s", [](const Header, const Request, Response) {});
  service = node.create_service<AddTwoInts>(
      "s", [](Header, Request) {}, ServicesQoS());
  service = node.create_service<AddTwoInts>("s", [](Self self, Header header, Request) {
    AddTwoInts::Response response;
    self->send_response(*header, response);
  });
  const ServiceBase::SharedPtr base = service;
  base->get_service_name();
}
// Row: `create_client`, `Client`, its futures and callbacks, `wait_for_service` | needs no spin
void clients(Node& node) {
  const Client<AddTwoInts>::SharedPtr client = node.create_client<AddTwoInts>("service");
  while (!client->wait_for_service(std::chrono::seconds(1))) client->service_is_ready();
  auto request = std::make_shared<AddTwoInts::Request>();
  auto future = client->async_send_request(request);
  Client<AddTwoInts>::SharedFuture shared = future.share();
  client->async_send_request(request, [](Client<AddTwoInts>::SharedFuture) {});
  client->async_send_request(request, [](Client<AddTwoInts>::SharedFutureWithRequest) {});
  const ClientBase::SharedPtr base = client;
  base->get_service_name();
}
// Row: `create_service`, `create_client` with an `rmw_qos_profile_t` | deprecated, as in rclcpp
void of_profiles(Node& node, CallbackGroup::SharedPtr group) {
  const auto serve = [](std::shared_ptr<AddTwoInts::Request>,
                        std::shared_ptr<AddTwoInts::Response>) {};
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  create_service<AddTwoInts>(node.get_node_base_interface(), node.get_node_services_interface(),
                             "service", serve, rmw_qos_profile_services_default, group);
  create_client<AddTwoInts>(node.get_node_base_interface(), node.get_node_graph_interface(),
                            node.get_node_services_interface(), "service",
                            rmw_qos_profile_services_default, group);
#pragma GCC diagnostic pop
}
// Row: `remove_pending_request`, `prune_pending_requests`, `prune_requests_older_than` |
void pending_requests(Client<AddTwoInts>& client) {
  client.remove_pending_request(1);
  client.prune_pending_requests();
  client.prune_requests_older_than(std::chrono::system_clock::now());
}
// Row: `rclcpp_action`: `create_server`, `Server`, `ServerGoalHandle` | goals may be deferred
void action_server(Node::SharedPtr node) {
  using namespace rclcpp_action;  // NOLINT(google-build-using-namespace): names of another library
  using Handle = std::shared_ptr<ServerGoalHandle<Fibonacci>>;
  const rclcpp_action::Server<Fibonacci>::SharedPtr server =
      rclcpp_action::create_server<Fibonacci>(
          node, "action",
          [](const GoalUUID&, std::shared_ptr<const Fibonacci::Goal>) {
            return GoalResponse::ACCEPT_AND_DEFER;
          },
          [](const Handle) { return rclcpp_action::CancelResponse::ACCEPT; },
          [](const Handle goal) {
            goal->execute();
            goal->publish_feedback(std::make_shared<Fibonacci::Feedback>());
            const auto result = std::make_shared<Fibonacci::Result>();
            if (goal->is_canceling()) return goal->canceled(result);
            if (goal->get_goal()->order < 0) return goal->abort(result);
            if (goal->is_active() && goal->is_executing()) goal->succeed(result);
          });
}
// Row: `rclcpp_action`: `create_client`, `Client`, `ClientGoalHandle`, `WrappedResult` |
void action_client(Node::SharedPtr node) {
  using ActionClient = rclcpp_action::Client<Fibonacci>;
  const auto client = rclcpp_action::create_client<Fibonacci>(node, "action");
  client->wait_for_action_server(std::chrono::seconds(1));
  ActionClient::SendGoalOptions options;
  options.goal_response_callback = [](ActionClient::GoalHandle::SharedPtr) {};
  options.feedback_callback = [](ActionClient::GoalHandle::SharedPtr,
                                 std::shared_ptr<const Fibonacci::Feedback>) {};
  options.result_callback = [](const ActionClient::WrappedResult&) {};
  const auto handle = client->async_send_goal(Fibonacci::Goal(), options).get();
  client->async_get_result(handle).get().result->sequence.clear();
  client->async_cancel_goal(handle);
  client->async_cancel_all_goals();
  client->async_cancel_goals_before(node->now());
}

}  // namespace rclcpp::elements::supported
