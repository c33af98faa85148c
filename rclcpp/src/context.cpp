// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/context.hpp"

#include <algorithm>
#include <utility>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/programs/program.hpp"

#include "arguments.hpp"
#include "context_time_source.hpp"
#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/logging.hpp"
#include "rclcpp/utilities.hpp"
#include "signals.hpp"

namespace rclcpp {

std::size_t InitOptions::get_domain_id() const {
  try {
    return domain_ ? *domain_ : static_cast<std::size_t>(takt::default_domain());
  } catch (const takt::Error& error) {
    throw exceptions::RCLError(RCL_RET_ERROR, error.what());
  }
}

Context::Context() : arguments_(std::make_unique<detail::Arguments>()) {
}
Context::~Context() {
  try {
    shutdown("context is destroyed");
  } catch (...) {
    takt::log(takt::LogLevel::error, "a shutdown callback threw: {}",
              takt::text_of(std::current_exception()));
  }
}

void Context::init(int argc, char const* const* argv, const InitOptions& options) {
  if (is_valid()) throw ContextAlreadyInitialized();
  takt::programs::Program::instance();
  options.get_domain_id();  // a wrong ROS_DOMAIN_ID is an error of init, not of the first node
  auto arguments = std::make_unique<detail::Arguments>(
      detail::parse_arguments(std::vector<std::string>(argv, argv + argc)));
  if (options.auto_initialize_logging()) {
    for (const auto& [logger, level] : arguments->levels) {
      get_logger(logger).set_level(static_cast<Logger::Level>(level));
    }
  }
  wait_for_shutdown();
  const std::lock_guard lock(mutex_);
  options_ = options;
  arguments_ = std::move(arguments);
  container_.reset();
  reason_.clear();
  is_valid_.store(true);
  detail::shut_down_on_signal(*this);
}

void Context::enter_container(const takt::NodeOptions& options) {
  wait_for_shutdown();
  const std::lock_guard lock(mutex_);
  if (is_valid()) return;
  container_ = {options.participant, options.time_source, options.end_container};
  reason_.clear();
  is_valid_.store(true);
}

std::string Context::shutdown_reason() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

// Calls all callbacks even if one throws; `failure` keeps the first exception.
void Context::call(Callbacks& callbacks, std::exception_ptr& failure) {
  callbacks.each(Callbacks::Order::first_added, [&](const auto& callback) {
    try {
      callback();
    } catch (...) {
      if (failure == nullptr) failure = std::current_exception();
    }
    return true;
  });
}

// Waits for a shutdown that another thread runs, but not in a callback of that shutdown.
void Context::wait_for_shutdown() {
  if (!is_ending_.load()) return;
  const takt::detail::WaitInCallback wait(&is_ending_);
  wait.until([&] { return wait.is_for_itself() || !is_ending_.load(); });
}

bool Context::shutdown(const std::string& reason) {
  bool is_owner = false;
  {
    const std::lock_guard lock(mutex_);
    is_owner = is_valid() && !is_ending_.exchange(true);
  }
  if (!is_owner) {
    wait_for_shutdown();
    return false;
  }
  std::exception_ptr failure;
  {
    const struct End {
      std::atomic<bool>& is_ending;
      const takt::detail::Running running{&is_ending};
      ~End() {
        is_ending.store(false);
        takt::detail::WaitInCallback::notify_progress();
      }
    } end{is_ending_};
    call(before_shutdown_, failure);
    std::function<void()> end_container;
    {
      const std::lock_guard lock(mutex_);
      is_valid_.store(false);
      reason_ = reason;
      if (container_) end_container = container_->end;
      for (takt::Wakeable* waiter : waiters_) waiter->wake();
      ended_.notify_all();
    }
    if (contexts::get_global_default_context().get() == this)
      takt::programs::Program::instance().cancel();
    detail::forget_on_signal(*this);
    call(on_shutdown_, failure);
    if (end_container) end_container();
  }
  if (failure != nullptr) std::rethrow_exception(failure);
  return true;
}

Context::OnShutdownCallback Context::on_shutdown(OnShutdownCallback callback) {
  add_on_shutdown_callback(callback);
  return callback;
}
ShutdownCallbackHandle Context::add(Callbacks& callbacks, std::function<void()> callback) {
  ShutdownCallbackHandle handle;
  handle.callback_ = callbacks.add(std::move(callback));
  return handle;
}
OnShutdownCallbackHandle Context::add_on_shutdown_callback(OnShutdownCallback callback) {
  return add(on_shutdown_, std::move(callback));
}
PreShutdownCallbackHandle Context::add_pre_shutdown_callback(PreShutdownCallback callback) {
  return add(before_shutdown_, std::move(callback));
}
bool Context::remove_on_shutdown_callback(const OnShutdownCallbackHandle& handle) {
  return on_shutdown_.remove(handle.callback_.lock().get());
}
bool Context::remove_pre_shutdown_callback(const PreShutdownCallbackHandle& handle) {
  return before_shutdown_.remove(handle.callback_.lock().get());
}

bool Context::sleep_for(const std::chrono::nanoseconds& duration) {
  takt::programs::refuse("waits for a time in main() or in a callback");
  const takt::TimePoint end = takt::later(takt::Clock::steady().now(), duration);
  std::unique_lock lock(mutex_);
  ended_.wait_until(lock, end, [&] { return !is_valid(); });
  return is_valid();
}

const detail::Arguments& Context::arguments() const {
  return *arguments_;
}
std::shared_ptr<takt::Participant> Context::participant() {
  const std::lock_guard lock(mutex_);
  if (container_) return container_->participant.lock();  // nullptr in a container without DDS
  if (takt::programs::is_simulated()) return nullptr;
  auto participant = participant_.lock();
  if (participant == nullptr) {
    takt::DdsOptions options;
    options.domain = static_cast<int>(options_.get_domain_id());
    participant = takt::Participant::create(options);
    participant_ = participant;
  }
  return participant;
}
std::shared_ptr<takt::SimulatedClock::Source> Context::time_source() {
  const std::lock_guard lock(mutex_);
  if (container_) return container_->time_source;
  auto source = time_source_.lock();
  if (source == nullptr) {
    source = std::make_shared<detail::ContextTimeSource>(*this);
    time_source_ = source;
  }
  return source;
}

void Context::add_waiter(takt::Wakeable& waiter) {
  const std::lock_guard lock(mutex_);
  waiters_.push_back(&waiter);
}
void Context::remove_waiter(takt::Wakeable& waiter) noexcept {
  const std::lock_guard lock(mutex_);
  std::erase(waiters_, &waiter);
}

namespace contexts {
DefaultContext::SharedPtr get_global_default_context() {
  // Never destroyed: objects with static storage use it.
  static const auto* context = new DefaultContext::SharedPtr(std::make_shared<DefaultContext>());
  return *context;
}
}  // namespace contexts

namespace {
Context::SharedPtr or_default(Context::SharedPtr context) {
  return context != nullptr ? std::move(context) : contexts::get_global_default_context();
}
}  // namespace

void init(int argc, char const* const* argv, const InitOptions& options,
          SignalHandlerOptions signals) {
  contexts::get_global_default_context()->init(argc, argv, options);
  if (!takt::programs::is_simulated()) install_signal_handlers(signals);
}
std::vector<std::string> init_and_remove_ros_arguments(int argc, char const* const* argv,
                                                       const InitOptions& options) {
  init(argc, argv, options);
  return remove_ros_arguments(argc, argv);
}
std::vector<std::string> remove_ros_arguments(int argc, char const* const* argv) {
  return detail::parse_arguments(std::vector<std::string>(argv, argv + argc)).rest;
}
bool ok(Context::SharedPtr context) {
  return or_default(std::move(context))->is_valid();
}
bool shutdown(Context::SharedPtr context, const std::string& reason) {
  const bool is_default = context == nullptr;
  const bool was_valid = or_default(std::move(context))->shutdown(reason);
  if (is_default) uninstall_signal_handlers();
  return was_valid;
}
void on_shutdown(std::function<void()> callback, Context::SharedPtr context) {
  or_default(std::move(context))->on_shutdown(std::move(callback));
}
bool sleep_for(const std::chrono::nanoseconds& duration, Context::SharedPtr context) {
  return or_default(std::move(context))->sleep_for(duration);
}

}  // namespace rclcpp
