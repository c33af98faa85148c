// A part of a program: it owns entities, and gives them names.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_NODE_HPP_
#define TAKT_ENTITIES_NODE_HPP_

#include <atomic>
#include <concepts>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/entities/guard_condition.hpp"
#include "takt/entities/parameter.hpp"
#include "takt/entities/publisher.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/entities/timer.hpp"

namespace takt {

/// What is decided about a node from outside. A component's constructor takes it and hands it on.
struct NodeOptions {
  std::string name;                                     // instead of the one the code gives
  std::string name_space;                               // "/front"; empty: the root
  Parameters parameters;                                // instead of the declared defaults
  std::map<std::string, std::string, std::less<>> remap;  // topic as the code names it → topic
  Clock* clock = &Clock::steady();
};

class Node;

/// An executor that serves the node or some of its groups: told of what the node gets later.
class NodeListener {
 public:
  virtual void entity_added(Node& node, const std::shared_ptr<Entity>& entity) = 0;
  virtual void group_added(Node& node, const std::shared_ptr<CallbackGroup>& group) = 0;

 protected:
  ~NodeListener() = default;
};

/// Names, parameters, and a factory of entities. The node knows its entities weakly: they live as
/// long as the user holds them (dropping the last pointer takes an entity from its executor), the
/// default callback group as long as the node.
///
/// Thread safety: every method from any thread. Entities may be created and dropped while the
/// executor spins, from callbacks too.
/// Real-time: set-up only; creating and dropping entities allocates and takes locks.
class Node : public std::enable_shared_from_this<Node> {
 public:
  explicit Node(std::string_view name, const NodeOptions& options = {});
  virtual ~Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  const std::string& name() const noexcept { return name_; }
  const std::string& name_space() const noexcept { return name_space_; }
  std::string fully_qualified_name() const;
  Clock& clock() const noexcept { return *options_.clock; }

  std::shared_ptr<CallbackGroup> create_callback_group(std::string name, CallbackGroupType type,
                                                       bool automatically_add_to_executor = true);
  const std::shared_ptr<CallbackGroup>& default_callback_group() const noexcept {
    return default_group_;
  }

  /// `name` is what configuration files, chains and results call the timer.
  std::shared_ptr<Timer> create_timer(std::string name, Nanoseconds period,
                                      std::function<void()> callback,
                                      std::shared_ptr<CallbackGroup> group = nullptr);

  /// `callback` may be empty, for a guard condition that only wakes a WaitSet.
  std::shared_ptr<GuardCondition> create_guard_condition(
      std::string name, std::function<void()> callback = {},
      std::shared_ptr<CallbackGroup> group = nullptr);

  template <Message T>
  std::shared_ptr<Publisher<T>> create_publisher(std::string_view topic, const QoS& qos,
                                                 PublisherOptions<T> options = {}) {
    return std::make_shared<Publisher<T>>(resolve(topic), qos, clock(), std::move(options));
  }

  template <Message T, SubscriptionCallback<T> F>
  std::shared_ptr<Subscription<T>> create_subscription(
      std::string_view topic, const QoS& qos, F callback,
      std::shared_ptr<CallbackGroup> group = nullptr) {
    auto subscription = std::make_shared<CallbackSubscription<T, F>>(
        std::string(topic), group_or_default(std::move(group)),
        Endpoint{resolve(topic), &message_type<T>(), qos}, std::move(callback));
    auto handle = adopt<Subscription<T>>(subscription);
    subscription->join();
    return handle;
  }

  /// The value that the configuration gives, or `value`. Throws Error when the types differ.
  template <class T>
  T declare_parameter(std::string_view name, T value) {
    return get<T>(name, declare(name, ParameterValue(widened(std::move(value)))));
  }
  /// Throws Error when it was not declared.
  template <class T>
  T get_parameter(std::string_view name) const {
    return get<T>(name, find_parameter(name));
  }

  /// The topic's name on the wire: remapped, and "~/x" and relative names made absolute.
  std::string resolve(std::string_view topic);

  // For executors and containers.

  std::vector<std::shared_ptr<Entity>> entities() const;
  std::vector<std::shared_ptr<CallbackGroup>> groups() const;
  /// From here on the listener is told of every entity and group. Adding it again does nothing.
  void add_listener(NodeListener& listener);
  void remove_listener(NodeListener& listener) noexcept;
  /// Makes the node as a whole this listener's; false when it is another's.
  bool claim(const NodeListener* owner) noexcept;
  void release(const NodeListener* owner) noexcept;
  bool belongs_to(const NodeListener* owner) const noexcept { return owner_.load() == owner; }
  /// Names in the options that the code has never asked for: parameters, then remaps.
  std::vector<std::string> unused_parameters() const;
  std::vector<std::string> unused_remaps() const;

 private:
  // int and float literals become the parameter types int64 and double.
  template <class T>
  static auto widened(T value) {
    if constexpr (std::same_as<T, bool>) {
      return value;
    } else if constexpr (std::integral<T>) {
      return static_cast<std::int64_t>(value);
    } else if constexpr (std::floating_point<T>) {
      return static_cast<double>(value);
    } else if constexpr (std::convertible_to<T, std::string>) {
      return std::string(std::move(value));
    } else {
      return value;
    }
  }
  template <class T>
  T get(std::string_view name, const ParameterValue& value) const {
    using Stored = decltype(widened(std::declval<T>()));
    if (const auto* stored = std::get_if<Stored>(&value)) return static_cast<T>(*stored);
    throw_wrong_type(name, value, ParameterValue(Stored{}));
  }
  [[noreturn]] void throw_wrong_type(std::string_view name, const ParameterValue& is,
                                     const ParameterValue& wanted) const;
  const ParameterValue& declare(std::string_view name, ParameterValue value);
  const ParameterValue& find_parameter(std::string_view name) const;

  std::shared_ptr<CallbackGroup> group_or_default(std::shared_ptr<CallbackGroup> group) const;
  void add(const std::shared_ptr<Entity>& entity);

  /// Adds the entity, and makes the pointer for the user: when it goes, the entity retires.
  template <class Handle, class Concrete>
  std::shared_ptr<Handle> adopt(std::shared_ptr<Concrete> entity) {
    add(entity);
    Handle* address = entity.get();
    return std::shared_ptr<Handle>(address, [entity = std::move(entity)](Handle*) mutable {
      entity->retire();
      entity.reset();
    });
  }

  const NodeOptions options_;
  const std::string name_;
  const std::string name_space_;
  const std::shared_ptr<CallbackGroup> default_group_;

  mutable PiMutex mutex_;  // guards all below
  std::vector<std::weak_ptr<Entity>> entities_;
  std::vector<std::weak_ptr<CallbackGroup>> groups_;
  std::vector<NodeListener*> listeners_;
  Parameters parameters_;  // the declared ones
  std::set<std::string, std::less<>> used_remaps_;

  std::atomic<const NodeListener*> owner_{nullptr};
};

}  // namespace takt

#endif  // TAKT_ENTITIES_NODE_HPP_
