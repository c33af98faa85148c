// Waits for entities without an executor, over Takt's wait set.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__WAIT_SET_HPP_
#define RCLCPP__WAIT_SET_HPP_

#include <array>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <vector>

#include "takt/executors/wait_set.hpp"

#include "rclcpp/client.hpp"
#include "rclcpp/detail/refused.hpp"
#include "rclcpp/guard_condition.hpp"
#include "rclcpp/service.hpp"
#include "rclcpp/subscription.hpp"
#include "rclcpp/timer.hpp"

/// The result of a wait, as in rcl: an entity that is not ready is nullptr.
struct rcl_wait_set_t {
  std::vector<const void*> subscriptions, guard_conditions, timers, clients, services;
  std::size_t size_of_subscriptions = 0, size_of_guard_conditions = 0, size_of_timers = 0,
              size_of_clients = 0, size_of_services = 0;
};

namespace rclcpp {

enum class WaitResultKind { Ready, Timeout, Empty, Invalid };

/// No effect: Takt's wait set waits for the messages of a subscription only.
struct SubscriptionWaitSetMask {
  bool include_subscription = true;
  bool include_events = false;
  bool include_intra_process_waitable = true;
};

template <class Set>
class WaitResult {
 public:
  WaitResult(WaitResultKind kind, Set& set) : kind_(kind), set_(&set) {}
  WaitResultKind kind() const { return kind_; }
  const Set& get_wait_set() const { return checked(), *set_; }
  Set& get_wait_set() { return checked(), *set_; }

 private:
  void checked() const {
    if (kind_ != WaitResultKind::Ready) {
      throw std::runtime_error("cannot access wait set when the result was not ready");
    }
  }
  const WaitResultKind kind_;
  Set* const set_;
};

namespace detail {

/// The entities of a wait set, and which of them are ready.
/// Thread safety: one thread waits; others may add and remove. Real-time: no.
class WaitSetCore final : takt::Wakeable {
 public:
  enum class Kind { subscription, guard_condition, timer, client, service };
  struct Member {
    Kind kind;
    std::shared_ptr<const void> object;
    std::shared_ptr<takt::Entity> entity;
  };

  explicit WaitSetCore(Context::SharedPtr context);
  ~WaitSetCore();
  WaitSetCore(const WaitSetCore&) = delete;
  WaitSetCore& operator=(const WaitSetCore&) = delete;

  /// Throws std::runtime_error when the entity is in a wait set or executor already.
  template <class T>
  void add(Kind kind, const std::shared_ptr<T>& object) {
    if (object == nullptr) throw std::invalid_argument("entity must not be null");
    add(Member{kind, object, object->entity()});
  }
  /// Throws std::runtime_error when the entity is not in this wait set.
  void remove(const std::shared_ptr<const void>& object);
  WaitResultKind wait(std::chrono::nanoseconds timeout);
  const rcl_wait_set_t& ready() const { return ready_; }

 private:
  void add(Member member);
  Member take(const std::shared_ptr<const void>& object);  // empty: not here
  void collect(const std::vector<std::shared_ptr<takt::Entity>>& ready);
  void wake() noexcept override { stop_->trigger(); }

  const Context::SharedPtr context_;
  const std::shared_ptr<takt::GuardCondition> stop_;
  std::mutex mutex_;  // guards what follows
  std::vector<Member> members_;
  rcl_wait_set_t ready_;  // of the last wait
  takt::WaitSet set_;
};

struct NoWaitable {};  // Takt's wait set takes no waitables: see docs/reference/rclcpp.md

/// Common to wait sets with fixed and with changing entities.
template <class Set>
class WaitSetBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(Set)
  using WaitableEntry = NoWaitable;
  struct SubscriptionEntry {
    std::shared_ptr<SubscriptionBase> subscription;
    SubscriptionWaitSetMask mask;

    SubscriptionEntry(std::shared_ptr<SubscriptionBase> entry = nullptr,  // NOLINT: as in rclcpp
                      const SubscriptionWaitSetMask& which = {})
        : subscription(std::move(entry)), mask(which) {}
  };

  /// The result is Timeout also when the context is shut down.
  template <class Rep = std::int64_t, class Period = std::milli>
  WaitResult<Set> wait(
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
    return {core_->wait(std::chrono::duration_cast<std::chrono::nanoseconds>(timeout)),
            static_cast<Set&>(*this)};
  }
  const rcl_wait_set_t& get_rcl_wait_set() const { return core_->ready(); }

 protected:
  using Kind = WaitSetCore::Kind;
  explicit WaitSetBase(Context::SharedPtr context)
      : core_(std::make_unique<WaitSetCore>(std::move(context))) {}

  template <class Subscriptions, class Guards, class Timers, class Clients, class Services>
  void add_all(const Subscriptions& subscriptions, const Guards& guards, const Timers& timers,
               const Clients& clients, const Services& services) {
    for (const auto& entry : subscriptions) core_->add(Kind::subscription, entry.subscription);
    for (const auto& entry : guards) core_->add(Kind::guard_condition, entry);
    for (const auto& entry : timers) core_->add(Kind::timer, entry);
    for (const auto& entry : clients) core_->add(Kind::client, entry);
    for (const auto& entry : services) core_->add(Kind::service, entry);
  }

  const std::unique_ptr<WaitSetCore> core_;
};

template <class Set>
class DynamicWaitSet : public WaitSetBase<Set> {
  using Base = WaitSetBase<Set>;
  using typename Base::Kind;

 public:
  using typename Base::SubscriptionEntry;

  explicit DynamicWaitSet(const std::vector<SubscriptionEntry>& subscriptions = {},
                          const std::vector<GuardCondition::SharedPtr>& guard_conditions = {},
                          const std::vector<TimerBase::SharedPtr>& timers = {},
                          const std::vector<ClientBase::SharedPtr>& clients = {},
                          const std::vector<ServiceBase::SharedPtr>& services = {},
                          const std::vector<NoWaitable>& = {},
                          Context::SharedPtr context = contexts::get_global_default_context())
      : Base(std::move(context)) {
    this->add_all(subscriptions, guard_conditions, timers, clients, services);
  }

  void add_subscription(std::shared_ptr<SubscriptionBase> entity, SubscriptionWaitSetMask = {}) {
    this->core_->add(Kind::subscription, entity);
  }
  void remove_subscription(std::shared_ptr<SubscriptionBase> entity, SubscriptionWaitSetMask = {}) {
    this->core_->remove(entity);
  }
  void add_guard_condition(GuardCondition::SharedPtr entity) {
    this->core_->add(Kind::guard_condition, entity);
  }
  void remove_guard_condition(GuardCondition::SharedPtr entity) { this->core_->remove(entity); }
  void add_timer(TimerBase::SharedPtr entity) { this->core_->add(Kind::timer, entity); }
  void remove_timer(TimerBase::SharedPtr entity) { this->core_->remove(entity); }
  void add_client(ClientBase::SharedPtr entity) { this->core_->add(Kind::client, entity); }
  void remove_client(ClientBase::SharedPtr entity) { this->core_->remove(entity); }
  void add_service(ServiceBase::SharedPtr entity) { this->core_->add(Kind::service, entity); }
  void remove_service(ServiceBase::SharedPtr entity) { this->core_->remove(entity); }
  RCLCPP_REFUSED_(add_waitable, "waitables")
  RCLCPP_REFUSED_(remove_waitable, "waitables")
};

}  // namespace detail

class WaitSet : public detail::DynamicWaitSet<WaitSet> {
 public:
  using DynamicWaitSet::DynamicWaitSet;
};
class ThreadSafeWaitSet : public detail::DynamicWaitSet<ThreadSafeWaitSet> {
 public:
  using DynamicWaitSet::DynamicWaitSet;
};

/// A wait set whose entities are fixed at construction.
template <std::size_t kSubscriptions, std::size_t kGuardConditions, std::size_t kTimers,
          std::size_t kClients, std::size_t kServices, std::size_t kWaitables>
class StaticWaitSet
    : public detail::WaitSetBase<StaticWaitSet<kSubscriptions, kGuardConditions, kTimers, kClients,
                                               kServices, kWaitables>> {
  static_assert(kWaitables == 0,
                "Takt's wait sets take no waitables: see docs/reference/rclcpp.md");
  using Base = detail::WaitSetBase<StaticWaitSet>;

 public:
  using typename Base::SubscriptionEntry;
  explicit StaticWaitSet(
      const std::array<SubscriptionEntry, kSubscriptions>& subscriptions = {},
      const std::array<GuardCondition::SharedPtr, kGuardConditions>& guard_conditions = {},
      const std::array<TimerBase::SharedPtr, kTimers>& timers = {},
      const std::array<ClientBase::SharedPtr, kClients>& clients = {},
      const std::array<ServiceBase::SharedPtr, kServices>& services = {},
      const std::array<detail::NoWaitable, kWaitables>& = {},
      Context::SharedPtr context = contexts::get_global_default_context())
      : Base(std::move(context)) {
    this->add_all(subscriptions, guard_conditions, timers, clients, services);
  }
};

}  // namespace rclcpp

#endif  // RCLCPP__WAIT_SET_HPP_
