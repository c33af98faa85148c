// The state between init and shutdown: arguments, and the participant of the nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__CONTEXT_HPP_
#define RCLCPP__CONTEXT_HPP_

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "takt/base/future.hpp"
#include "takt/base/simulated_clock.hpp"
#include "takt/entities/callback_list.hpp"
#include "takt/nodes/node_options.hpp"
#include "takt/transport/dds/participant.hpp"

#include "rclcpp/detail/refused.hpp"
#include "rclcpp/init_options.hpp"
#include "rclcpp/macros.hpp"

namespace rclcpp {

namespace detail {
struct Arguments;
class ContextTimeSource;
}  // namespace detail

class ContextAlreadyInitialized : public std::runtime_error {
 public:
  ContextAlreadyInitialized() : std::runtime_error("context is already initialized") {}
};

/// The handle of a shutdown callback, needed to remove it.
class ShutdownCallbackHandle {
 public:
  using ShutdownCallbackType = std::function<void()>;

 private:
  friend class Context;
  std::weak_ptr<takt::detail::Removable<void()>> callback_;
};
using OnShutdownCallbackHandle = ShutdownCallbackHandle;
using PreShutdownCallbackHandle = ShutdownCallbackHandle;

/// Thread safety: every method from any thread.
/// Real-time: set-up only, but for is_valid.
class Context : public std::enable_shared_from_this<Context> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Context)
  using OnShutdownCallback = std::function<void()>;
  using PreShutdownCallback = OnShutdownCallback;

  Context();
  virtual ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Parses the arguments after `--ros-args`. Throws ContextAlreadyInitialized, UnknownROSArgsError
  /// or RCLInvalidROSArgsError.
  virtual void init(int argc, char const* const* argv, const InitOptions& options = InitOptions());
  bool is_valid() const noexcept { return is_valid_.load(); }
  const InitOptions& get_init_options() const { return options_; }
  std::size_t get_domain_id() const { return options_.get_domain_id(); }
  std::string shutdown_reason() const;
  /// Calls all shutdown callbacks, then throws the first of their exceptions. False if the context
  /// was not valid; if another thread is shutting it down, waits until the callbacks have returned,
  /// except in one of these callbacks.
  virtual bool shutdown(const std::string& reason);

  // A removed callback is not called any more. Removal waits for a call on another thread, unless
  // that call waits for the caller.

  virtual OnShutdownCallback on_shutdown(OnShutdownCallback callback);
  virtual OnShutdownCallbackHandle add_on_shutdown_callback(OnShutdownCallback callback);
  virtual bool remove_on_shutdown_callback(const OnShutdownCallbackHandle& handle);
  virtual PreShutdownCallbackHandle add_pre_shutdown_callback(PreShutdownCallback callback);
  virtual bool remove_pre_shutdown_callback(const PreShutdownCallbackHandle& handle);

  /// Sleeps until the time is over or the context is shut down. Returns whether the context is
  /// still valid.
  bool sleep_for(const std::chrono::nanoseconds& duration);
  bool sleep_until(std::chrono::steady_clock::time_point time);

  RCLCPP_REFUSED_(get_rcl_context, "rcl's handles")
  // For this library.

  const detail::Arguments& arguments() const;
  /// The participant of the context's nodes. They own it: it is destroyed with the last of them.
  std::shared_ptr<takt::Participant> participant();
  std::shared_ptr<takt::SimulatedClock::Source> time_source();
  /// shutdown() wakes this waiter.
  void add_waiter(takt::Wakeable& waiter);
  void remove_waiter(takt::Wakeable& waiter) noexcept;
  /// For a Takt container that makes a component: the context is valid until the container ends,
  /// shutdown() ends the container, and nodes of the component are on the container's participant.
  /// Does nothing if the context is valid already.
  void enter_container(const takt::NodeOptions& options);

 private:
  struct InContainer {
    std::weak_ptr<takt::Participant> participant;
    std::shared_ptr<takt::SimulatedClock::Source> time_source;
    std::function<void()> end;
  };
  using Callbacks = takt::detail::CallbackList<void()>;
  static ShutdownCallbackHandle add(Callbacks& callbacks, std::function<void()> callback);
  static void call(Callbacks& callbacks, std::exception_ptr& failure);
  void wait_for_shutdown();

  std::atomic<bool> is_valid_{false};
  std::atomic<bool> is_ending_{false};  // a thread runs shutdown()
  Callbacks on_shutdown_, before_shutdown_;
  mutable std::mutex mutex_;  // guards all below, and changes of is_valid_
  std::condition_variable ended_;
  InitOptions options_;
  std::unique_ptr<detail::Arguments> arguments_;
  std::string reason_;
  std::vector<takt::Wakeable*> waiters_;
  std::weak_ptr<takt::Participant> participant_;
  std::weak_ptr<detail::ContextTimeSource> time_source_;
  std::optional<InContainer> container_;
};

namespace contexts {
class DefaultContext : public Context {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(DefaultContext)
};
DefaultContext::SharedPtr get_global_default_context();
}  // namespace contexts

}  // namespace rclcpp

#endif  // RCLCPP__CONTEXT_HPP_
