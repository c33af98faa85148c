// The executors of rclcpp, and the functions that spin a node on an executor of their own.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__EXECUTORS_HPP_
#define RCLCPP__EXECUTORS_HPP_

#include <chrono>
#include <memory>

#include "rclcpp/executor.hpp"

namespace rclcpp {
namespace executors {

/// Takt's `single_threaded`.
class SingleThreadedExecutor : public Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(SingleThreadedExecutor)
  explicit SingleThreadedExecutor(const ExecutorOptions& options = ExecutorOptions())
      : Executor(options) {}
};
/// Also Takt's `single_threaded`, so callbacks may be added and removed while it spins.
class StaticSingleThreadedExecutor : public Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(StaticSingleThreadedExecutor)
  explicit StaticSingleThreadedExecutor(const ExecutorOptions& options = ExecutorOptions())
      : Executor(options) {}
};
/// Takt's `multi_threaded`.
class MultiThreadedExecutor : public Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(MultiThreadedExecutor)
  /// `number_of_threads` 0: one for each CPU, at least two. The other two arguments have no effect.
  explicit MultiThreadedExecutor(const ExecutorOptions& options = ExecutorOptions(),
                                 std::size_t number_of_threads = 0,
                                 bool yield_before_execute = false,
                                 std::chrono::nanoseconds timeout = std::chrono::nanoseconds(-1));
  std::size_t get_number_of_threads() { return threads_; }

 private:
  const std::size_t threads_;
};
/// Takt's `events` with several threads; rclcpp has this class since ROS 2 Lyrical.
class EventsCBGExecutor : public Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(EventsCBGExecutor)
  explicit EventsCBGExecutor(const ExecutorOptions& options = ExecutorOptions(),
                             std::size_t number_of_threads = 0,
                             std::chrono::nanoseconds timeout = std::chrono::nanoseconds(-1));
  std::size_t get_number_of_threads() { return threads_; }

 private:
  const std::size_t threads_;
};

template <class F, class Rep = std::int64_t, class Period = std::milli, class N>
FutureReturnCode spin_node_until_future_complete(
    Executor& executor, const N& node, const F& future,
    std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
  const Executor::With with(executor, node_interfaces::get_node_base_interface(node));
  return executor.spin_until_future_complete(future, timeout);
}

}  // namespace executors

namespace experimental::executors {
/// Takt's `events`.
class EventsExecutor : public Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(EventsExecutor)
  explicit EventsExecutor(const ExecutorOptions& options = ExecutorOptions())
      : Executor(options, "events") {}
};
}  // namespace experimental::executors

void spin(node_interfaces::NodeBaseInterface::SharedPtr node);
void spin(std::shared_ptr<Node> node);
void spin_some(node_interfaces::NodeBaseInterface::SharedPtr node);
void spin_some(std::shared_ptr<Node> node);
void spin_all(node_interfaces::NodeBaseInterface::SharedPtr node,
              std::chrono::nanoseconds max_duration);
void spin_all(std::shared_ptr<Node> node, std::chrono::nanoseconds max_duration);

template <class F, class Rep = std::int64_t, class Period = std::milli>
FutureReturnCode spin_until_future_complete(
    node_interfaces::NodeBaseInterface::SharedPtr node, const F& future,
    std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
  rclcpp::executors::SingleThreadedExecutor executor;
  executor.add_node(node);
  return executor.spin_until_future_complete(future, timeout);
}
template <class N, class F, class Rep = std::int64_t, class Period = std::milli>
FutureReturnCode spin_until_future_complete(
    std::shared_ptr<N> node, const F& future,
    std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) {
  return spin_until_future_complete(node->get_node_base_interface(), future, timeout);
}

}  // namespace rclcpp

#endif  // RCLCPP__EXECUTORS_HPP_
