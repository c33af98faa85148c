// Node: creates publishers, subscriptions, timers and other entities, and gives them names.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_NODE_HPP_
#define TAKT_NODES_NODE_HPP_

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/ros_time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/client.hpp"
#include "takt/entities/file_descriptor.hpp"
#include "takt/entities/generic_publisher.hpp"
#include "takt/entities/generic_subscription.hpp"
#include "takt/entities/guard_condition.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/entities/qos_event.hpp"
#include "takt/entities/receiver.hpp"
#include "takt/entities/service.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/entities/task_runner.hpp"
#include "takt/entities/timer.hpp"
#include "takt/nodes/node_options.hpp"
#include "takt/nodes/parameter.hpp"
#include "takt/nodes/publishing_callbacks.hpp"

namespace TAKT_PUBLIC takt {

class Node;
/// Node::now() for what may outlive the node.
[[nodiscard]] std::function<Time()> stamps_of(const Node& node);

/// Throws Error when a node cannot have this name.
void check_node_name(std::string_view name);
/// "/front/imu"; the namespace may be empty. Throws Error where a Node of these names would.
std::string full_node_name(std::string_view name_space, std::string_view name);
/// Whether a topic or service can have this full name. Others may use names that ROS 2 lacks.
bool is_topic_name(std::string_view name) noexcept;

/// New parameters of a node's callback groups and callbacks, by name.
struct CallbackParameterChanges {
  std::map<std::string, CallbackParameters, std::less<>> callback_groups, callbacks;
};

/// An executor that serves the node or some of its groups: notified of later additions.
/// Thread safety: called on the thread that makes the change; several threads may call at a time.
/// Real-time: no; set-up only.
class NodeListener {
 public:
  virtual void entity_added(Node& node, const std::shared_ptr<Entity>& entity) = 0;
  virtual void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) = 0;
  virtual void parameters_changed(Node& node) = 0;

 protected:
  ~NodeListener() = default;
};

/// Names, parameters, and a factory for entities. The node holds weak references to its entities:
/// they live as long as the user holds them (dropping the last pointer removes an entity from its
/// executor). The default callback group lives as long as the node.
///
/// Thread safety: every method from any thread. Entities may be created and dropped while the
/// executor spins, also from callbacks.
/// Real-time: set-up only; creating and dropping entities allocates and takes locks.
class Node : public std::enable_shared_from_this<Node> {
 public:
  using SharedPtr = std::shared_ptr<Node>;

  explicit Node(std::string_view name);
  Node(std::string_view name, const NodeOptions& options);
  virtual ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  const std::string& name() const noexcept { return name_; }
  const std::string& name_space() const noexcept { return name_space_; }
  const std::string& fully_qualified_name() const noexcept { return fully_qualified_name_; }
  /// The clock of its timers; with a time source, simulated while `use_sim_time` is true.
  Clock& clock() const noexcept { return clock_; }
  /// For stamps of messages: the system's time, or simulated time as `clock()`. Real-time: yes.
  [[nodiscard]] Time now() const noexcept;

  /// Writes a line that begins with the node's name. Real-time: as Logger.
  template <class... Arguments>
  void log(LogLevel level, const std::type_identity_t<LogFormat<Arguments...>>& format,
           Arguments&&... arguments) const {
    write_log(level, format.where, format.format, fmt::make_format_args(arguments...));
  }

  [[nodiscard]] std::shared_ptr<CallbackGroup> create_callback_group(
      std::string name, CallbackGroupType type, bool automatically_add_to_executor = true);
  const std::shared_ptr<CallbackGroup>& default_callback_group() const noexcept {
    return default_group_;
  }

  /// Files, chains and results refer to it by `name`. Without `autostart` it is cancelled at first.
  [[nodiscard]] std::shared_ptr<Timer> create_timer(std::string name, Nanoseconds period,
                                                    std::function<void()> callback,
                                                    std::shared_ptr<CallbackGroup> group = nullptr,
                                                    bool autostart = true) {
    return make_timer(clock(), std::move(name), period, std::move(callback), std::move(group),
                      autostart);
  }
  /// The callback is a coroutine, see Task.
  template <TaskCallback F>
  [[nodiscard]] std::shared_ptr<Timer> create_timer(std::string name, Nanoseconds period,
                                                    F callback,
                                                    std::shared_ptr<CallbackGroup> group = nullptr,
                                                    bool autostart = true) {
    return make_timer(clock(), std::move(name), period, std::move(callback), std::move(group),
                      autostart);
  }
  /// As rclcpp's: uses real time, even if the node's clock is simulated. The first is called
  /// "wall_timer_1", the next "wall_timer_2", and so on.
  template <class F>
  [[nodiscard]] std::shared_ptr<Timer> create_wall_timer(
      Nanoseconds period, F callback, std::shared_ptr<CallbackGroup> group = nullptr,
      bool autostart = true) {
    return create_wall_timer(next_wall_timer_name(), period, std::move(callback), std::move(group),
                             autostart);
  }
  template <class F>
  [[nodiscard]] std::shared_ptr<Timer> create_wall_timer(
      std::string name, Nanoseconds period, F callback,
      std::shared_ptr<CallbackGroup> group = nullptr, bool autostart = true) {
    return make_timer(clock().real(), std::move(name), period, std::move(callback),
                      std::move(group), autostart);
  }

  /// `callback` may be empty, for a guard condition that only wakes a WaitSet.
  [[nodiscard]] std::shared_ptr<GuardCondition> create_guard_condition(
      std::string name, std::function<void()> callback = {},
      std::shared_ptr<CallbackGroup> group = nullptr);

  // It would be made, and never run.
  template <TaskCallback F>
  [[nodiscard]] std::shared_ptr<GuardCondition> create_guard_condition(
      std::string name, F callback, std::shared_ptr<CallbackGroup> group = nullptr) = delete;

  /// A callback for events of a publisher or a subscription besides messages. The status that it
  /// takes selects the event: MatchedStatus, IncompatibleQosStatus, MessageLostStatus,
  /// DeadlineMissedStatus or LivelinessChangedStatus (these two: see EndpointEvent). There is one
  /// of a kind for each end; the one that is made last is notified. Throws Error for a deadline
  /// event if the QoS has no deadline. Its name is "TOPIC/publisher/deadline_missed" and so on.
  template <class Status, class End>
  [[nodiscard]] std::shared_ptr<Entity> create_qos_event(
      const End& end, std::function<void(const Status&)> callback,
      std::shared_ptr<CallbackGroup> group = nullptr) {
    std::string name = qos_event_name(
        end.topic(), std::derived_from<End, SubscriptionBase> ? "subscription" : "publisher",
        Status::kName);
    if constexpr (std::same_as<Status, DeadlineMissedStatus>) {
      check_deadline(end.topic(), end.qos());
      return adopt<Entity>(std::make_shared<DeadlineEvent>(
          std::move(name), group_or_default(std::move(group)), clock().real(),
          end.qos().deadline_period, end.events(), std::move(callback)));
    } else {
      auto event =
          std::make_shared<EventOf<Status>>(std::move(name), group_or_default(std::move(group)),
                                            clock().real(), end.events(), std::move(callback));
      auto handle = adopt<Entity>(event);
      event->start();
      return handle;
    }
  }

  /// A callback for a device, pipe or socket. `fd` stays yours: keep it open until the entity is
  /// dropped, and close it afterwards. Throws Error when it cannot be waited for.
  [[nodiscard]] std::shared_ptr<FileDescriptor> create_file_descriptor(
      std::string name, int fd, FileDescriptorEvents events,
      std::function<void(FileDescriptorEvents)> callback,
      std::shared_ptr<CallbackGroup> group = nullptr);
  template <TaskCallback<FileDescriptorEvents> F>
  [[nodiscard]] std::shared_ptr<FileDescriptor> create_file_descriptor(
      std::string name, int fd, FileDescriptorEvents events, F callback,
      std::shared_ptr<CallbackGroup> group = nullptr) = delete;

  template <Message T>
  [[nodiscard]] std::shared_ptr<Publisher<T>> create_publisher(
      std::string_view topic, const QoS& qos, const PublisherOptions<T>& options = {}) {
    auto publisher = std::make_shared<Publisher<T>>(
        publisher_endpoint(topic, message_type<T>(), qos, options.loans,
                           {options.published_by, options.joins}, options.graph_node),
        clock().real(), options, options_.participant);
    publisher->trace_made(this);
    return publisher;
  }

  template <Message T, SubscriptionCallback<T> F>
  [[nodiscard]] std::shared_ptr<Subscription<T>> create_subscription(
      std::string_view topic, const QoS& qos, F callback,
      std::shared_ptr<CallbackGroup> group = nullptr) {
    group = group_or_default(std::move(group));
    auto subscription =
        std::make_shared<SubscriptionWith<T, F>>(std::string(topic), group, endpoint<T>(topic, qos),
                                                 std::move(callback), options_.participant);
    if constexpr (CallbackSubscription<T, F>::kIsTask) {
      subscription->set_runner(create_task_runner(std::string(topic), group, 1));
    }
    auto handle = adopt<Subscription<T>>(subscription);
    subscription->start();
    return handle;
  }

  /// Creates a receiver of messages for coroutines.
  template <Message T>
  [[nodiscard]] std::shared_ptr<Receiver<T>> create_receiver(
      std::string_view topic, const QoS& qos, std::shared_ptr<CallbackGroup> group = nullptr) {
    auto receiver =
        std::make_shared<Receiver<T>>(std::string(topic), group_or_default(std::move(group)),
                                      endpoint<T>(topic, qos), options_.participant);
    auto handle = adopt<Receiver<T>>(receiver);
    receiver->start();
    return handle;
  }

  /// Publishes encoded messages of the type with this name: "std_msgs/msg/String".
  [[nodiscard]] std::shared_ptr<GenericPublisher> create_generic_publisher(std::string_view topic,
                                                                           std::string_view type,
                                                                           const QoS& qos);
  [[nodiscard]] std::shared_ptr<SubscriptionBase> create_generic_subscription(
      std::string_view topic, std::string_view type, const QoS& qos, SerializedCallback callback,
      std::shared_ptr<CallbackGroup> group = nullptr);

  /// `callback` is called with a request and an empty response to fill in, and may be a coroutine;
  /// or with the request and its RequestId, see Service::send_response.
  template <ServiceType S, ServiceCallback<S> F>
  [[nodiscard]] std::shared_ptr<Service<S>> create_service(
      std::string_view name, F callback, std::shared_ptr<CallbackGroup> group = nullptr,
      const ServiceOptions& options = {}) {
    group = group_or_default(std::move(group));
    auto service = std::make_shared<CallbackService<S, F>>(
        std::string(name), group, resolve(name),
        options.graph_node.empty() ? fully_qualified_name_ : options.graph_node, clock().real(),
        std::move(callback), options, options_.participant);
    if constexpr (CallbackService<S, F>::kIsTask) {
      service->set_runner(create_task_runner(std::string(name), group, 1));
    }
    auto handle = adopt<Service<S>>(service);
    service->start();
    return handle;
  }

  template <ServiceType S>
  [[nodiscard]] std::shared_ptr<Client<S>> create_client(
      std::string_view name, const ClientOptions& options = {},
      std::shared_ptr<CallbackGroup> group = nullptr) {
    auto client = std::make_shared<Client<S>>(std::string(name), group_or_default(std::move(group)),
                                              resolve(name), fully_qualified_name_, clock().real(),
                                              options, options_.participant);
    if (options.timeout != Nanoseconds::zero() || options.without_service != Nanoseconds::max()) {
      auto timer =
          std::make_shared<Timer>(timeout_name(name), client->group(), clock().real(),
                                  std::chrono::hours(1), [weak = std::weak_ptr<Client<S>>(client)] {
                                    // So it lives until that returns, dropped or not.
                                    if (const auto alive = weak.lock()) alive->end_late_calls();
                                  });
      timer->cancel();  // before an executor has it, as the client has not got it yet
      client->set_timer(adopt<Timer>(std::move(timer)));
    }
    auto handle = adopt<Client<S>>(client);
    client->start();
    return handle;
  }

  /// Resumes coroutines, for authors of callback kinds that are made of others: at most
  /// `most_tasks` at a time. `callback` gives it its name.
  [[nodiscard]] std::shared_ptr<TaskRunner> create_task_runner(const std::string& callback,
                                                               std::shared_ptr<CallbackGroup> group,
                                                               std::size_t most_tasks);

  /// The value that the configuration gives, or `value`, whose type is the parameter's. Integers
  /// are taken for floating-point numbers, in lists also for bytes, and an empty list for one of
  /// any type. Throws Error when it is of another type, out of the descriptor's range, more than T
  /// can hold, or refused by an on-set callback. For a parameter of any type, T is ParameterValue.
  template <class T>
  T declare_parameter(std::string_view name, T value, ParameterDescriptor descriptor = {}) {
    return detail::as<T>(name_, name,
                         declare_value(name, detail::widened(std::move(value)),
                                       std::move(descriptor), detail::integer_limits<T>()));
  }
  /// One after another, as "NAME_SPACE.name"; their values in the order of their names.
  template <class T>
  std::vector<T> declare_parameters(const std::string& name_space,
                                    const std::map<std::string, T>& parameters) {
    std::map<std::string, std::pair<T, ParameterDescriptor>> described;
    for (const auto& [name, value] : parameters) described[name].first = value;
    return declare_parameters(name_space, described);
  }
  template <class T>
  std::vector<T> declare_parameters(
      const std::string& name_space,
      const std::map<std::string, std::pair<T, ParameterDescriptor>>& parameters) {
    const std::string prefix = name_space.empty() ? "" : name_space + ".";
    std::vector<T> values;
    for (const auto& [name, parameter] : parameters) {
      values.push_back(declare_parameter(prefix + name, parameter.first, parameter.second));
    }
    return values;
  }
  /// Throws Error when it was not declared, is read-only, or has a fixed type. If it is declared
  /// again, the configuration gives its value again.
  void undeclare_parameter(std::string_view name);
  /// ParameterValue as T takes every type. Throws Error when it was not declared, or is of another
  /// type. Real-time: of a boolean or a number, a lock with priority inheritance, and no
  /// allocation; a callback that needs many of them each time better copies them when they are set.
  template <class T>
  T get_parameter(std::string_view name) const {
    return detail::as<T>(name_, name, parameter_value(name));
  }
  /// The alternative if it was not declared, or is not set.
  template <class T>
  T get_parameter_or(std::string_view name, T alternative) const {
    ParameterValue value = parameter_if_set(name);
    if (value.index() == 0) return alternative;
    return detail::as<T>(name_, name, std::move(value));
  }
  /// Together, in the order of the names. Throws Error when one was not declared.
  std::vector<Parameter> get_parameters(const std::vector<std::string>& names) const;
  /// Those with names of the form "PREFIX.x", as "x"; without a prefix, all.
  Parameters get_parameters_by_prefix(std::string_view prefix) const;
  bool has_parameter(std::string_view name) const;
  /// Throws Error when it was not declared.
  ParameterDescriptor describe_parameter(std::string_view name) const;
  std::vector<ParameterDescriptor> describe_parameters(const std::vector<std::string>& names) const;
  /// Names that equal a prefix, or have the form "PREFIX.x" with at most `depth` parts after the
  /// prefix; without prefixes, all names with at most `depth` parts. 0: no limit.
  ListParametersResult list_parameters(const std::vector<std::string>& prefixes = {},
                                       std::uint64_t depth = 0) const;
  /// Sets all values, or none and returns the reason: a parameter is not declared, read-only, of
  /// another type or out of range, a callback refuses, other threads have changed parameters each
  /// of ten times while callbacks checked the values, or a thousand changes wait for post-set
  /// callbacks. A value that is not set undeclares a parameter of any type. Throws Error in a
  /// parameter callback of this node.
  [[nodiscard]] SetParametersResult set_parameters_atomically(const Parameters& values);
  /// One after another: a result for each.
  std::vector<SetParametersResult> set_parameters(const std::vector<Parameter>& parameters);

  // Parameter callbacks run without a lock. The one that was added last is called first. They may
  // read parameters and call all else, but not set or declare parameters of this node, nor
  // set one of another node whose callback does. What a callback throws reaches the one that sets
  // or declares: a pre-set or on-set callback keeps the values from being set then.

  /// The callback gets the values that are to be set, but not those that are declared, and may
  /// change, add and remove some; if none is left, setting fails. For the rest, as
  /// add_on_set_parameters_callback.
  [[nodiscard]] PreSetParametersHandle add_pre_set_parameters_callback(
      PreSetParametersCallback callback);
  /// The callback gets values that are valid by their descriptors, before they are set or declared,
  /// on the thread that does so; parameters have their old values. If several threads set
  /// parameters, it runs on them at the same time, and it is called again for values when another
  /// thread has changed parameters meanwhile. Only the callback that was added first knows that no
  /// other refuses. So to act on values, use a post-set callback.
  [[nodiscard]] OnSetParametersHandle add_on_set_parameters_callback(
      OnSetParametersCallback callback);
  /// The callback gets values that were set or declared, change by change in the order in which
  /// they were made, one at a time. It runs on the thread that sets or declares; but if that of
  /// another thread is running, then on that thread, afterwards: the one that sets does not wait
  /// for it, and what the callback throws reaches the other. Parameters have their new values, or
  /// newer ones.
  [[nodiscard]] PostSetParametersHandle add_post_set_parameters_callback(
      PostSetParametersCallback callback);
  /// For ParameterServices. Empty: none. When this returns, the previous listener is not called any
  /// more. It is called with a lock held: it may read parameters, but not set or declare any.
  void set_parameters_listener(ParametersListener listener);

  /// The topic's name on the wire: remapped, and "~/x" and relative names made absolute.
  std::string resolve(std::string_view topic);

  /// Changes the given parameters, and keeps all others. All changes take effect together: no
  /// callback of the node's executor runs between them. Handlers are not changed. Throws Error, and
  /// changes nothing, if a name does not exist or a value is invalid.
  void set_callback_parameters(const CallbackParameterChanges& changes);
  /// Throws the same Error, and changes nothing.
  void check_callback_parameters(const CallbackParameterChanges& changes) const;
  /// The parameters of an entity: its own ones, completed by those of its group.
  CallbackParameters callback_parameters(const Entity& entity) const;

  // For executors and containers.

  /// The callback with this name; the first slash of a topic may be missing. If there is none,
  /// throws an Error that lists the names.
  std::shared_ptr<Entity> find_entity(std::string_view name) const;
  /// Whether this callback may publish on the topic, according to the options of the publishers.
  bool publishes(std::string_view callback, std::string_view topic) const;
  /// Empty if the node does not publish on the topic.
  std::optional<PublishingCallbacks> publishing_callbacks(std::string_view topic) const;
  std::vector<std::shared_ptr<Entity>> entities() const;
  std::vector<std::shared_ptr<CallbackGroup>> groups() const;
  /// From now on, calls the listener for every entity and group. Adding it again has no effect.
  void add_listener(NodeListener& listener);
  /// When it returns, no call of the listener runs, except one that the calling thread is in.
  void remove_listener(NodeListener& listener) noexcept;
  /// Assigns the whole node to this listener; returns false if it belongs to another one.
  bool claim(const NodeListener* owner) noexcept;
  void release(const NodeListener* owner) noexcept;
  bool belongs_to(const NodeListener* owner) const noexcept { return owner_.load() == owner; }
  /// Names in the options that the code has never asked for: parameters, then remaps.
  std::vector<std::string> unused_parameters() const;
  std::vector<std::string> unused_remaps() const;
  /// The full names of the topics that the code has asked for so far.
  std::vector<std::string> topics() const;
  /// nullptr: messages stay in the process.
  const std::shared_ptr<Participant>& participant() const noexcept { return options_.participant; }
  /// Names that two timers have had at the same time: files and results cannot tell them apart.
  std::vector<std::string> timers_of_one_name() const;

 protected:
  // For nodes that create entities of other kinds.

  /// What the code asks for, as the options have it.
  template <Message T>
  Endpoint endpoint(std::string_view topic, const QoS& qos) {
    return endpoint(topic, message_type<T>(), qos);
  }
  Endpoint endpoint(std::string_view topic, const MessageType& type, const QoS& qos);
  /// The same for a publisher, with what its PublisherOptions say, which it remembers.
  Endpoint publisher_endpoint(std::string_view topic, const MessageType& type, const QoS& qos,
                              std::size_t loans, PublishingCallbacks callbacks,
                              const std::string& graph_node);
  std::shared_ptr<CallbackGroup> group_or_default(std::shared_ptr<CallbackGroup> group) const;
  /// Throws Error if the timer's name is invalid; warns if another timer has it.
  std::shared_ptr<Timer> adopt_timer(std::shared_ptr<Timer> timer);
  std::string next_wall_timer_name();
  /// The entity that resumes the coroutines of a callback.
  std::shared_ptr<TaskRunner> adopt_task_runner(std::shared_ptr<TaskRunner> runner);

  /// Adds the entity, and makes the pointer for the user: when it goes, the entity retires.
  template <class Handle, class Concrete>
  std::shared_ptr<Handle> adopt(std::shared_ptr<Concrete> entity) {
    Handle* const address = entity.get();
    return std::shared_ptr<Handle>(adopt_entity(std::move(entity)), address);
  }

 private:
  struct State;

  void write_log(LogLevel level, const SourceLocation& where, fmt::string_view format,
                 fmt::format_args arguments) const;
  ParameterValue declare_value(std::string_view name, ParameterValue value,
                               ParameterDescriptor descriptor, const detail::IntegerLimits& limits);
  ParameterValue parameter_value(std::string_view name) const;
  ParameterValue parameter_if_set(std::string_view name) const;
  void declare_use_sim_time();
  void simulate_time(bool simulated);
  std::shared_ptr<Entity> adopt_entity(std::shared_ptr<Entity> entity);
  QoS decide(const std::string& topic, const QoS& code);
  void remember_output(const std::string& topic, const PublishingCallbacks& callbacks);
  static void check_deadline(const std::string& topic, const QoS& qos);
  static std::string qos_event_name(std::string_view topic, std::string_view end,
                                    std::string_view event);
  /// "/arm/move" → "arm_move_timeout".
  static std::string timeout_name(std::string_view service);
  std::shared_ptr<Timer> make_timer(Clock& clock, std::string name, Nanoseconds period,
                                    std::function<void()> callback,
                                    std::shared_ptr<CallbackGroup> group, bool autostart);
  template <TaskCallback F>
  std::shared_ptr<Timer> make_timer(Clock& clock, std::string name, Nanoseconds period, F callback,
                                    std::shared_ptr<CallbackGroup> group, bool autostart) {
    group = group_or_default(std::move(group));
    auto runner = create_task_runner(name, group, 1);
    auto timer = std::make_shared<TaskTimer>(std::move(name), std::move(group), clock, period,
                                             std::move(callback), std::move(runner));
    if (!autostart) timer->cancel();  // before an executor has it
    return adopt_timer(std::move(timer));
  }
  void add(const std::shared_ptr<Entity>& entity);
  struct ChangedParameters {
    std::map<CallbackGroup*, CallbackParameters> groups;
    std::map<Entity*, CallbackParameters> callbacks;
  };
  ChangedParameters checked(const CallbackParameterChanges& changes,
                            const std::vector<std::shared_ptr<CallbackGroup>>& groups,
                            const std::vector<std::shared_ptr<Entity>>& entities) const;

  const NodeOptions options_;
  const std::shared_ptr<SimulatedClock> own_clock_;  // nullptr: none is needed
  Clock& clock_;
  const std::string name_, name_space_, fully_qualified_name_;
  const std::shared_ptr<CallbackGroup> default_group_;
  const std::unique_ptr<State> state_;
  std::atomic<const NodeListener*> owner_{nullptr};
};

}  // namespace takt

#endif  // TAKT_NODES_NODE_HPP_
