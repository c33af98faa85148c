// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/node.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "takt/base/held_locks.hpp"
#include "takt/base/never_destroyed.hpp"
#include "takt/base/tracepoints.hpp"
#include "takt/entities/traced.hpp"
#include "takt/nodes/node_state.hpp"

namespace takt {

NodeOptions::~NodeOptions() = default;
namespace {

// ROS 2's rule for a token of a name.
bool is_name(std::string_view name) {
  return !name.empty() && std::isdigit(static_cast<unsigned char>(name[0])) == 0 &&
         std::all_of(name.begin(), name.end(), [](unsigned char character) {
           return std::isalnum(character) != 0 || character == '_';
         });
}

void check_name(std::string_view name, std::string_view what) {
  if (!is_name(name)) {
    throw Error(fmt::format("'{}' cannot be the name of a {}", name, what),
                "use letters, digits and '_', not beginning with a digit");
  }
}

void check_path(std::string_view path, std::string_view what) {
  if (is_topic_name(path)) return;
  throw Error(fmt::format("'{}' cannot be the name of a {}", path, what),
              "use letters, digits and '_' between slashes: '/front/scan'");
}

std::string absolute_name_space(std::string_view name_space) {
  if (name_space.empty() || name_space == "/") return {};
  std::string result(name_space.starts_with('/') ? "" : "/");
  result += name_space;
  check_path(result, "namespace");
  return result;
}

// The names of the nodes of this process, by the participant that announces them.
class NodeNames {
 public:
  static NodeNames& instance() {
    static detail::NeverDestroyed<NodeNames> names;
    return *names;
  }
  /// False: another node has this name already.
  bool add(const Participant* participant, const std::string& name) {
    const std::lock_guard lock(mutex_);
    return ++counts_[{participant, name}] == 1;
  }
  void remove(const Participant* participant, const std::string& name) noexcept {
    const std::lock_guard lock(mutex_);
    const auto found = counts_.find({participant, name});
    if (--found->second == 0) counts_.erase(found);
  }

 private:
  std::mutex mutex_;
  std::map<std::pair<const Participant*, std::string>, int> counts_;
};

}  // namespace

bool is_topic_name(std::string_view name) noexcept {
  do {
    if (!name.starts_with('/')) return false;
    name.remove_prefix(1);
    const std::size_t slash = std::min(name.find('/'), name.size());
    if (!is_name(name.substr(0, slash))) return false;
    name.remove_prefix(slash);
  } while (!name.empty());
  return true;
}

void check_node_name(std::string_view name) {
  check_name(name, "node");
}

std::string full_node_name(std::string_view name_space, std::string_view name) {
  check_node_name(name);
  return absolute_name_space(name_space) + "/" + std::string(name);
}

Node::Node(std::string_view name) : Node(name, NodeOptions()) {
}

Node::Node(std::string_view name, const NodeOptions& options)
    : options_(options),
      own_clock_(options_.time_source == nullptr
                     ? nullptr
                     : std::make_shared<SimulatedClock>(options_.clock->real(), false)),
      clock_(own_clock_ != nullptr ? *own_clock_ : *options_.clock),
      name_(options.name.empty() ? std::string(name) : options.name),
      name_space_(absolute_name_space(options.name_space)),
      fully_qualified_name_(name_space_ + "/" + name_),
      default_group_(
          std::make_shared<CallbackGroup>("default", CallbackGroupType::MutuallyExclusive)),
      state_(std::make_unique<State>(name_, options)) {
  check_node_name(name_);
  if (const Tracepoints* const points = tracepoints()) {
    points->rcl_node_init(this, options_.participant.get(), name_.c_str(),
                          name_space_.empty() ? "/" : name_space_.c_str());
  }
  state_->groups.push_back(default_group_);
  declare_use_sim_time();
  if (options_.participant != nullptr) options_.participant->add_node(fully_qualified_name_);
  if (!NodeNames::instance().add(options_.participant.get(), fully_qualified_name_)) {
    log(LogLevel::warn,
        "another node has this name too; give each its own name or namespace, as parameters, "
        "services and results cannot tell them apart");
  }
}

Node::~Node() {
  detail::expect_no_lock("node");
  NodeNames::instance().remove(options_.participant.get(), fully_qualified_name_);
  if (options_.participant != nullptr) options_.participant->remove_node(fully_qualified_name_);
}

void Node::write_log(LogLevel level, const SourceLocation& where, fmt::string_view format,
                     fmt::format_args arguments) const {
  Logger& logger = Logger::instance();
  if (level >= options_.log_level.value_or(logger.level())) {
    logger.write(fully_qualified_name_, level, where, format, arguments);
  }
}

std::shared_ptr<CallbackGroup> Node::create_callback_group(std::string name, CallbackGroupType type,
                                                           bool automatically_add_to_executor) {
  check_name(name, "callback group");
  const std::vector<std::shared_ptr<CallbackGroup>> existing = groups();
  if (std::any_of(existing.begin(), existing.end(),
                  [&](const auto& group) { return group->name() == name; })) {
    throw Error(fmt::format("node '{}' has two callback groups called '{}'", name_, name),
                "give each group of a node its own name");
  }
  auto group =
      std::make_shared<CallbackGroup>(std::move(name), type, automatically_add_to_executor);
  {
    const std::lock_guard lock(state_->mutex);
    std::erase_if(state_->groups, [](const auto& known) { return known.expired(); });
    state_->groups.push_back(group);
  }
  state_->notify([&](NodeListener& listener) { listener.group_added(*this, group); });
  return group;
}

std::shared_ptr<CallbackGroup> Node::group_or_default(std::shared_ptr<CallbackGroup> group) const {
  if (group == nullptr) return default_group_;
  return group;
}

std::string Node::timeout_name(std::string_view service) {
  std::string name(service.substr(std::min(service.find_first_not_of("/~"), service.size())));
  std::replace(name.begin(), name.end(), '/', '_');
  return name + "_timeout";
}

std::shared_ptr<Entity> Node::adopt_entity(std::shared_ptr<Entity> entity) {
  std::shared_ptr<Entity> handle(entity.get(), [entity](Entity*) mutable {
    Entity& retiring = *entity;
    retiring.retire();
    retiring.retired(std::move(entity));
  });
  trace_made(*entity, this, fully_qualified_name_);  // before it runs
  add(entity);  // if one executor refuses, ~handle removes it from the others
  return handle;
}

namespace {

/// The name, or "NAME#2" and so on, if the user holds others of this name.
std::string unused(const std::string& name, const std::vector<std::shared_ptr<Entity>>& others) {
  std::string result = name;
  const auto is_namesake = [&](const std::shared_ptr<Entity>& other) {
    if (other->name() != result) return false;
    const std::lock_guard lock(ownership_mutex());
    return !other->is_retired();
  };
  for (int i = 2; std::any_of(others.begin(), others.end(), is_namesake); ++i) {
    result = fmt::format("{}#{}", name, i);
  }
  return result;
}

}  // namespace

void Node::add(const std::shared_ptr<Entity>& entity) {
  const std::vector<std::shared_ptr<CallbackGroup>> known = groups();
  if (std::find(known.begin(), known.end(), entity->group()) == known.end()) {
    throw Error(fmt::format("'{}' of node '{}' was given a callback group of another node",
                            entity->name(), name_));
  }
  std::vector<std::shared_ptr<Entity>> others;  // the last pointer is dropped after the unlock
  {
    const std::lock_guard lock(state_->mutex);
    std::erase_if(state_->entities, [](const auto& old) { return old.expired(); });
    for (const auto& other : state_->entities) {
      if (auto alive = other.lock()) others.push_back(std::move(alive));
    }
    if (entity->kind() != EntityKind::timer) entity->name_ = unused(entity->name(), others);
    entity->drop_wait_ = options_.drop_wait;
    state_->entities.push_back(entity);
  }
  state_->notify([&](NodeListener& listener) { listener.entity_added(*this, entity); });
}

std::shared_ptr<Timer> Node::make_timer(Clock& clock, std::string name, Nanoseconds period,
                                        std::function<void()> callback,
                                        std::shared_ptr<CallbackGroup> group, bool autostart) {
  auto timer = std::make_shared<Timer>(std::move(name), group_or_default(std::move(group)), clock,
                                       period, std::move(callback));
  if (!autostart) timer->cancel();  // before an executor has it
  return adopt_timer(std::move(timer));
}

std::string Node::next_wall_timer_name() {
  const std::lock_guard lock(state_->mutex);
  return fmt::format("wall_timer_{}", ++state_->wall_timers);
}

std::shared_ptr<Timer> Node::adopt_timer(std::shared_ptr<Timer> timer) {
  check_name(timer->name(), "timer");
  const std::string name = timer->name();
  auto handle = adopt<Timer>(std::move(timer));
  bool is_first_warning = false;
  {
    const std::lock_guard lock(state_->mutex);
    std::erase_if(state_->timers, [](const auto& known) { return known.second.expired(); });
    if (!state_->timers.try_emplace(name, handle).second) {
      is_first_warning = state_->timers_of_one_name.insert(name).second;
    }
  }
  if (is_first_warning) {
    log(LogLevel::warn,
        "two timers are called '{}'; give each its own name, as files, chains and results cannot "
        "tell them apart",
        name);
  }
  return handle;
}

std::shared_ptr<TaskRunner> Node::create_task_runner(const std::string& callback,
                                                     std::shared_ptr<CallbackGroup> group,
                                                     std::size_t most_tasks) {
  return adopt_task_runner(std::make_shared<TaskRunner>(
      callback, group_or_default(std::move(group)), clock(), most_tasks));
}

std::shared_ptr<TaskRunner> Node::adopt_task_runner(std::shared_ptr<TaskRunner> runner) {
  // The alarm is called "tick/resumed/alarm": users cannot give such a name.
  auto alarm =
      std::make_shared<Timer>(runner->name() + "/alarm", runner->group(), runner->clock(),
                              std::chrono::hours(1), [to = runner.get()] { to->wake_sleepers(); });
  alarm->cancel();  // before an executor has it, as the runner has not got it yet
  runner->set_alarm(adopt<Timer>(std::move(alarm)));
  return adopt<TaskRunner>(std::move(runner));
}

std::shared_ptr<GuardCondition> Node::create_guard_condition(std::string name,
                                                             std::function<void()> callback,
                                                             std::shared_ptr<CallbackGroup> group) {
  check_name(name, "guard condition");
  return adopt<GuardCondition>(std::make_shared<GuardCondition>(
      std::move(name), group_or_default(std::move(group)), clock().real(), std::move(callback)));
}

std::shared_ptr<FileDescriptor> Node::create_file_descriptor(
    std::string name, int fd, FileDescriptorEvents events,
    std::function<void(FileDescriptorEvents)> callback, std::shared_ptr<CallbackGroup> group) {
  check_name(name, "file descriptor");
  return adopt<FileDescriptor>(
      std::make_shared<FileDescriptor>(std::move(name), group_or_default(std::move(group)),
                                       clock().real(), fd, events, std::move(callback)));
}

std::string Node::resolve(std::string_view topic) {
  const auto absolute = [this](std::string_view name) {
    if (name.starts_with("~/")) return fully_qualified_name() + std::string(name.substr(1));
    return name.starts_with('/') ? std::string(name) : name_space_ + "/" + std::string(name);
  };
  std::string result = absolute(topic);
  // As in ROS 2, fully qualified names are compared.
  const auto rule = std::find_if(options_.remap.begin(), options_.remap.end(),
                                 [&](const auto& one) { return absolute(one.first) == result; });
  if (rule != options_.remap.end()) {
    const std::lock_guard lock(state_->mutex);
    state_->used_remaps.emplace(rule->first);
    result = absolute(rule->second);
  }
  check_path(result, "topic");
  return result;
}

Endpoint Node::endpoint(std::string_view topic, const MessageType& type, const QoS& qos) {
  std::string name = resolve(topic);
  const QoS decided = decide(name, qos);
  return {std::move(name), &type, decided, fully_qualified_name_};
}

std::shared_ptr<GenericPublisher> Node::create_generic_publisher(std::string_view topic,
                                                                 std::string_view type,
                                                                 const QoS& qos) {
  return std::make_shared<GenericPublisher>(
      publisher_endpoint(topic, serialized_type(type), qos, 0, {}, {}), clock().real(),
      options_.participant);
}

std::shared_ptr<SubscriptionBase> Node::create_generic_subscription(
    std::string_view topic, std::string_view type, const QoS& qos, SerializedCallback callback,
    std::shared_ptr<CallbackGroup> group) {
  auto subscription = std::make_shared<GenericSubscription>(
      std::string(topic), group_or_default(std::move(group)),
      endpoint(topic, serialized_type(type), qos), std::move(callback), options_.participant);
  auto handle = adopt<SubscriptionBase>(subscription);
  subscription->start();
  return handle;
}

QoS Node::decide(const std::string& topic, const QoS& code) {
  const std::lock_guard lock(state_->mutex);
  state_->topics.insert(topic);
  const auto found = options_.qos.find(topic);
  return found != options_.qos.end() ? found->second.over(code) : code;
}

Endpoint Node::publisher_endpoint(std::string_view topic, const MessageType& type, const QoS& qos,
                                  std::size_t loans, PublishingCallbacks callbacks,
                                  const std::string& graph_node) {
  Endpoint end = endpoint(topic, type, qos);
  if (!graph_node.empty()) end.node = graph_node;
  callbacks.publishers = {{end.qos, loans}};
  remember_output(end.topic, callbacks);
  return end;
}

std::string Node::qos_event_name(std::string_view topic, std::string_view end,
                                 std::string_view event) {
  return fmt::format("{}/{}/{}", topic, end, event);
}

void Node::check_deadline(const std::string& topic, const QoS& qos) {
  if (qos.deadline_period != Nanoseconds::zero()) return;
  throw Error(fmt::format("'{}' has no deadline that could be missed", topic), "give its QoS one");
}

void Node::remember_output(const std::string& topic, const PublishingCallbacks& callbacks) {
  const std::lock_guard lock(state_->mutex);
  const auto [output, is_new] = state_->outputs.try_emplace(topic, callbacks);
  PublishingCallbacks& known = output->second;
  if (is_new) return;
  const auto add = [](auto& to, const auto& from) {  // a node may make the same publisher again
    for (const auto& each : from) {
      if (std::find(to.begin(), to.end(), each) == to.end()) to.push_back(each);
    }
  };
  add(known.publishers, callbacks.publishers);
  if (known.names.empty() || callbacks.names.empty()) {
    known.names.clear();
    known.joins = false;
  } else {
    // Two publishers that join different callbacks are not one join of all these, which publishes
    // less often.
    known.joins = known.joins && callbacks.joins && known.names == callbacks.names;
    add(known.names, callbacks.names);
  }
}

std::optional<PublishingCallbacks> Node::publishing_callbacks(std::string_view topic) const {
  const std::lock_guard lock(state_->mutex);
  const auto output = state_->outputs.find(topic);
  if (output == state_->outputs.end()) return {};
  return output->second;
}

bool Node::publishes(std::string_view callback, std::string_view topic) const {
  const auto known = publishing_callbacks(topic);
  return known && (known->names.empty() || std::find(known->names.begin(), known->names.end(),
                                                     callback) != known->names.end());
}

std::shared_ptr<Entity> Node::find_entity(std::string_view name) const {
  std::vector<std::string> names;
  for (const auto& entity : entities()) {
    const std::string& full = entity->name();
    if (full == name || (full.starts_with('/') && full.substr(1) == name)) return entity;
    names.push_back(entity->name());
  }
  throw Error(fmt::format("node '{}' has no callback '{}'", fully_qualified_name(), name),
              names.empty() ? "it has made none yet; make those of chains in its constructor"
                            : suggest(name, names));
}

std::vector<std::shared_ptr<Entity>> Node::entities() const {
  const std::lock_guard lock(state_->mutex);
  std::vector<std::shared_ptr<Entity>> result;
  for (const auto& entity : state_->entities) {
    if (auto alive = entity.lock()) result.push_back(std::move(alive));
  }
  return result;
}

std::vector<std::shared_ptr<CallbackGroup>> Node::groups() const {
  const std::lock_guard lock(state_->mutex);
  std::vector<std::shared_ptr<CallbackGroup>> result;
  for (const auto& group : state_->groups) {
    if (auto alive = group.lock()) result.push_back(std::move(alive));
  }
  return result;
}

void Node::add_listener(NodeListener& listener) {
  const std::lock_guard lock(state_->mutex);
  auto& listeners = state_->listeners;
  std::erase_if(listeners, [](const auto& known) { return known.second->is_gone(); });
  const bool is_known = std::any_of(listeners.begin(), listeners.end(), [&](const auto& known) {
    return known.first == &listener && !known.second->is_removed();
  });
  if (is_known) return;
  const auto get = [&listener]() -> NodeListener& { return listener; };
  listeners.emplace_back(&listener, state_->listener_calls.add(get));
}

// The entry stays until no call runs, so that every thread that removes the listener waits.
void Node::remove_listener(NodeListener& listener) noexcept {
  std::unique_lock lock(state_->mutex);
  auto known = state_->listeners;
  lock.unlock();
  std::erase_if(known, [&](const auto& each) { return each.first != &listener; });
  for (const auto& [address, entry] : known) entry->remove();
  lock.lock();
  std::erase_if(state_->listeners, [](const auto& each) { return each.second->is_gone(); });
}

bool Node::claim(const NodeListener* owner) noexcept {
  const NodeListener* nobody = nullptr;
  return owner_.compare_exchange_strong(nobody, owner);
}

void Node::release(const NodeListener* owner) noexcept {
  owner_.compare_exchange_strong(owner, nullptr);
}

std::vector<std::string> Node::unused_remaps() const {
  const std::lock_guard lock(state_->mutex);
  std::vector<std::string> result;
  for (const auto& [from, to] : options_.remap) {
    if (!state_->used_remaps.contains(from)) result.push_back(from);
  }
  return result;
}

std::vector<std::string> Node::timers_of_one_name() const {
  const std::lock_guard lock(state_->mutex);
  return {state_->timers_of_one_name.begin(), state_->timers_of_one_name.end()};
}

std::vector<std::string> Node::topics() const {
  const std::lock_guard lock(state_->mutex);
  return {state_->topics.begin(), state_->topics.end()};
}

}  // namespace takt
