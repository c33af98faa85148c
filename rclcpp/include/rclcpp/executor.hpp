// Executors, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__EXECUTOR_HPP_
#define RCLCPP__EXECUTOR_HPP_

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "takt/executors/executor.hpp"

#include "rclcpp/client.hpp"
#include "rclcpp/memory_strategy.hpp"
#include "rclcpp/node.hpp"

namespace rclcpp {

struct ExecutorOptions {
  Context::SharedPtr context = contexts::get_global_default_context();
  memory_strategy::MemoryStrategy::SharedPtr memory_strategy;
  std::size_t max_conditions = 0;
};

/// Holds its nodes by weak_ptr. Throws std::runtime_error when a node belongs to an executor
/// already, or when a second spin begins during the first.
/// Thread safety: every method from any thread. Real-time: as Takt's executor.
class Executor : takt::Wakeable {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS_NOT_COPYABLE(Executor)

  explicit Executor(const ExecutorOptions& options = ExecutorOptions());
  virtual ~Executor();

  virtual void add_node(node_interfaces::NodeBaseInterface::SharedPtr node, bool notify = true);
  virtual void add_node(std::shared_ptr<Node> node, bool notify = true);
  virtual void remove_node(node_interfaces::NodeBaseInterface::SharedPtr node, bool notify = true);
  virtual void remove_node(std::shared_ptr<Node> node, bool notify = true);
  virtual void add_callback_group(CallbackGroup::SharedPtr group,
                                  node_interfaces::NodeBaseInterface::SharedPtr node,
                                  bool notify = true);
  virtual void remove_callback_group(CallbackGroup::SharedPtr group, bool notify = true);
  virtual std::vector<std::weak_ptr<CallbackGroup>> get_all_callback_groups();
  virtual std::vector<std::weak_ptr<CallbackGroup>> get_manually_added_callback_groups();

  virtual void spin();
  virtual void spin_once(std::chrono::nanoseconds timeout = std::chrono::nanoseconds(-1));
  virtual void spin_some(std::chrono::nanoseconds max_duration = std::chrono::nanoseconds(0));
  virtual void spin_all(std::chrono::nanoseconds max_duration);
  void spin_node_some(node_interfaces::NodeBaseInterface::SharedPtr node);
  void spin_node_some(std::shared_ptr<Node> node);
  template <class N>
  void spin_node_once(const N& node,
                      std::chrono::nanoseconds timeout = std::chrono::nanoseconds(-1)) {
    const With with(*this, node_interfaces::get_node_base_interface(node));
    spin_once(timeout);
  }

  template <class F, class Rep = std::int64_t, class Period = std::milli>
  FutureReturnCode spin_until_future_complete(
      const F& future,
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
    return spin_until(
        [&] { return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready; },
        std::chrono::duration_cast<std::chrono::nanoseconds>(timeout));
  }

  /// Ends the running spin; if there is none, the next one.
  virtual void cancel();
  bool is_spinning() { return is_spinning_.load(); }

  // For this library.
  takt::Executor& takt() noexcept { return *takt_; }
  /// Adds a node for the lifetime of this object, unless a callback removes the node before.
  class With {
   public:
    With(Executor& executor, node_interfaces::NodeBaseInterface::SharedPtr node)
        : executor_(executor), node_(std::move(node)) {
      executor_.add_node(node_, false);
    }
    ~With() { executor_.release(node_); }
    With(const With&) = delete;
    With& operator=(const With&) = delete;

   private:
    Executor& executor_;
    const node_interfaces::NodeBaseInterface::SharedPtr node_;
  };

 protected:
  /// Wraps Takt's executor of this name.
  Executor(const ExecutorOptions& options, const std::string& name,
           const takt::ExecutorOptions& how = {});

 private:
  class Spinning;
  /// Removes the node. False: the node is not in this executor.
  bool forget(const node_interfaces::NodeBaseInterface::SharedPtr& node);
  /// As forget(), but logs errors instead of throwing, for destructors.
  void release(const node_interfaces::NodeBaseInterface::SharedPtr& node) noexcept;
  void wake() noexcept override { takt_->cancel(); }
  bool may_go_on() const noexcept { return !is_cancelled_.load() && context_->is_valid(); }
  FutureReturnCode spin_until(const std::function<bool()>& is_ready,
                              std::chrono::nanoseconds timeout);

  const Context::SharedPtr context_;
  std::unique_ptr<takt::Executor> takt_;
  std::atomic<bool> is_spinning_{false}, is_cancelled_{false};
  std::mutex mutex_;  // guards all below
  std::vector<std::weak_ptr<node_interfaces::NodeBaseInterface>> nodes_;
  std::vector<
      std::pair<std::weak_ptr<CallbackGroup>, std::weak_ptr<node_interfaces::NodeBaseInterface>>>
      groups_;
};

}  // namespace rclcpp

#endif  // RCLCPP__EXECUTOR_HPP_
