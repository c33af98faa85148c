// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/executor.hpp"

#include <algorithm>
#include <ostream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "takt/base/logger.hpp"
#include "takt/base/same_owner.hpp"
#include "takt/programs/program.hpp"

#include "rclcpp/executors.hpp"

namespace rclcpp {

using node_interfaces::NodeBaseInterface;
using takt::programs::Program;

namespace {
/// How often a spin polls for events that cannot wake it, such as a std::future.
constexpr std::chrono::nanoseconds kStep = std::chrono::milliseconds(10);
}  // namespace

std::string to_string(FutureReturnCode code) {
  switch (code) {
    case FutureReturnCode::SUCCESS:
      return "SUCCESS (0)";
    case FutureReturnCode::INTERRUPTED:
      return "INTERRUPTED (1)";
    default:
      return "TIMEOUT (2)";
  }
}
std::ostream& operator<<(std::ostream& stream, FutureReturnCode code) {
  return stream << to_string(code);
}

namespace detail {
bool wait_for(Context& context, std::chrono::nanoseconds timeout,
              const std::function<bool()>& is_true) {
  const auto end = takt::end_of(timeout, takt::Clock::steady().now());
  for (;;) {
    if (is_true()) return true;
    const auto left = takt::between(takt::Clock::steady().now(), end);
    if (left <= std::chrono::nanoseconds::zero()) return false;
    if (!context.sleep_for(std::min(left, kStep / 2))) return false;
  }
}
}  // namespace detail

/// One spin of an executor; a second one at the same time throws.
class Executor::Spinning : public takt::programs::LongSpin {
 public:
  Spinning(Executor& executor, const char* function, bool is_long = false) : executor_(executor) {
    if (executor_.is_spinning_.exchange(true)) {
      throw std::runtime_error(std::string(function) + " called while already spinning");
    }
    try {
      if (is_valid()) Program::instance().begin_spin(is_long ? this : nullptr);
    } catch (...) {
      executor_.is_spinning_.store(false);
      throw;
    }
  }
  ~Spinning() {
    Program::instance().has_spun();
    executor_.is_cancelled_.store(false);  // cancel() ends one spin only
    executor_.is_spinning_.store(false);
  }
  Spinning(const Spinning&) = delete;
  Spinning& operator=(const Spinning&) = delete;

  void cancel() override { executor_.cancel(); }
  void shut_down() override { executor_.context_->shutdown("the simulation is over"); }
  bool is_valid() const override { return executor_.context_->is_valid(); }

 private:
  Executor& executor_;
};

Executor::Executor(const ExecutorOptions& options) : Executor(options, "single_threaded") {
}
Executor::Executor(const ExecutorOptions& options, const std::string& name,
                   const takt::ExecutorOptions& how)
    : context_(options.context), takt_(Program::instance().make_executor(name, how)) {
  context_->add_waiter(*this);
}
Executor::~Executor() {
  context_->remove_waiter(*this);
  Program::instance().ends(*takt_);
  takt_.reset();  // detaches all nodes; a static executor would refuse to remove them
  const std::lock_guard lock(mutex_);
  for (const auto& weak : nodes_) {
    if (const auto node = weak.lock()) node->get_associated_with_executor_atomic().store(false);
  }
}

void Executor::add_node(NodeBaseInterface::SharedPtr node, bool) {
  if (node->get_associated_with_executor_atomic().exchange(true)) {
    throw std::runtime_error(std::string("Node '") + node->get_fully_qualified_name() +
                             "' has already been added to an executor.");
  }
  try {
    if (Program::instance().add(node->takt_node(), *takt_)) takt_->add_node(node->takt_node());
  } catch (...) {
    node->get_associated_with_executor_atomic().store(false);
    throw;
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(nodes_, [](const auto& known) { return known.expired(); });
  nodes_.push_back(node);
}
void Executor::add_node(std::shared_ptr<Node> node, bool notify) {
  add_node(node->get_node_base_interface(), notify);
}
bool Executor::forget(const NodeBaseInterface::SharedPtr& node) {
  {
    const std::lock_guard lock(mutex_);
    const auto is_meant = [&](const auto& known) { return takt::is_same_owner(known, node); };
    if (std::erase_if(nodes_, is_meant) == 0) return false;
  }
  if (Program::instance().removes(*node->takt_node())) takt_->remove_node(node->takt_node());
  node->get_associated_with_executor_atomic().store(false);
  return true;
}
void Executor::release(const NodeBaseInterface::SharedPtr& node) noexcept {
  try {
    forget(node);
  } catch (const std::exception& error) {
    takt::log(takt::LogLevel::error, "'{}' stays in its executor: {}",
              node->get_fully_qualified_name(), error.what());
  }
}
void Executor::remove_node(NodeBaseInterface::SharedPtr node, bool) {
  if (!forget(node)) {
    throw std::runtime_error("Node needs to be associated with this executor.");
  }
}
void Executor::remove_node(std::shared_ptr<Node> node, bool notify) {
  remove_node(node->get_node_base_interface(), notify);
}

void Executor::add_callback_group(CallbackGroup::SharedPtr group, NodeBaseInterface::SharedPtr node,
                                  bool) {
  const bool is_own = Program::instance().add(node->takt_node(), *takt_, group.get());
  try {
    if (is_own) takt_->add_callback_group(group, node->takt_node());
  } catch (const takt::Error& error) {
    throw std::runtime_error("Callback group has already been added to an executor: " +
                             std::string(error.what()));
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(groups_, [](const auto& known) { return known.first.expired(); });
  groups_.emplace_back(group, node);
}
void Executor::remove_callback_group(CallbackGroup::SharedPtr group, bool) {
  NodeBaseInterface::SharedPtr node;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(groups_.begin(), groups_.end(), [&](const auto& known) {
      return takt::is_same_owner(known.first, group);
    });
    if (found == groups_.end()) {
      throw std::runtime_error("Callback group needs to be associated with executor.");
    }
    node = found->second.lock();
    groups_.erase(found);
  }
  if (node != nullptr && Program::instance().removes(*node->takt_node(), group.get())) {
    takt_->remove_callback_group(group, node->takt_node());
  }
}
std::vector<std::weak_ptr<CallbackGroup>> Executor::get_manually_added_callback_groups() {
  const std::lock_guard lock(mutex_);
  std::vector<std::weak_ptr<CallbackGroup>> groups;
  for (const auto& [group, node] : groups_) groups.push_back(group);
  return groups;
}
std::vector<std::weak_ptr<CallbackGroup>> Executor::get_all_callback_groups() {
  auto groups = get_manually_added_callback_groups();
  const std::lock_guard lock(mutex_);
  for (const auto& weak : nodes_) {
    const auto node = weak.lock();
    if (node == nullptr) continue;
    node->for_each_callback_group([&](CallbackGroup::SharedPtr group) {
      if (group->automatically_add_to_executor()) groups.push_back(group);
    });
  }
  return groups;
}

// A cancel() of Takt's executor that an earlier spin did not use may end takt_->spin(): hence the
// loop.
void Executor::spin() {
  const Spinning spinning(*this, "spin()", /*is_long=*/true);
  try {
    while (may_go_on()) takt_->spin();
  } catch (...) {
    try {
      Program::instance().end_spin(spinning);
    } catch (...) {  // the first exception counts
    }
    throw;
  }
  Program::instance().end_spin(spinning);
}
// Executors of a configuration file may serve the node instead. Their callbacks do not end this
// call, so it waits at most kStep.
void Executor::spin_once(std::chrono::nanoseconds timeout) {
  const Spinning spinning(*this, "spin_once()");
  if (!may_go_on()) return;
  const bool waits = timeout < std::chrono::nanoseconds::zero() || timeout > kStep;
  takt_->spin_once(waits && Program::instance().is_serving() ? kStep : timeout);
}
void Executor::spin_some(std::chrono::nanoseconds max_duration) {
  const Spinning spinning(*this, "spin_some()");
  if (may_go_on()) takt_->spin_some(max_duration);
}
void Executor::spin_all(std::chrono::nanoseconds max_duration) {
  if (max_duration < std::chrono::nanoseconds::zero()) {
    throw std::invalid_argument("max_duration must be greater than or equal to 0");
  }
  const Spinning spinning(*this, "spin_all()");
  if (may_go_on()) takt_->spin_all(max_duration);
}
void Executor::spin_node_some(NodeBaseInterface::SharedPtr node) {
  const With with(*this, std::move(node));
  spin_some();
}
void Executor::spin_node_some(std::shared_ptr<Node> node) {
  spin_node_some(node->get_node_base_interface());
}

// A std::future cannot wake the executor when it becomes ready. Usually a callback of this executor
// completes it; for other threads, the loop checks the future every kStep.
FutureReturnCode Executor::spin_until(const std::function<bool()>& is_ready,
                                      std::chrono::nanoseconds timeout) {
  if (is_ready()) {
    if (!is_spinning()) is_cancelled_.store(false);  // cancel() was meant for this spin
    return FutureReturnCode::SUCCESS;
  }
  const Spinning spinning(*this, "spin_until_future_complete()");
  const auto end = takt::end_of(timeout, takt::Clock::steady().now());
  while (may_go_on()) {
    const auto left = takt::between(takt::Clock::steady().now(), end);
    takt_->spin_once(std::clamp(left, std::chrono::nanoseconds::zero(), kStep));
    if (is_ready()) return FutureReturnCode::SUCCESS;
    if (left <= std::chrono::nanoseconds::zero()) return FutureReturnCode::TIMEOUT;
  }
  return FutureReturnCode::INTERRUPTED;
}

void Executor::cancel() {
  is_cancelled_.store(true);
  if (is_spinning()) takt_->cancel();
}

namespace executors {
namespace {
std::size_t pool_size(std::size_t wanted) {
  return wanted != 0 ? wanted : std::max<std::size_t>(std::thread::hardware_concurrency(), 2);
}
takt::ExecutorOptions pool(std::size_t threads) {
  takt::ExecutorOptions options;
  options.threads.resize(pool_size(threads));
  return options;
}
}  // namespace

MultiThreadedExecutor::MultiThreadedExecutor(const ExecutorOptions& options, std::size_t threads,
                                             bool, std::chrono::nanoseconds)
    : Executor(options, "multi_threaded", pool(threads)), threads_(pool_size(threads)) {
}
EventsCBGExecutor::EventsCBGExecutor(const ExecutorOptions& options, std::size_t threads,
                                     std::chrono::nanoseconds)
    : Executor(options, "events", pool(threads)), threads_(pool_size(threads)) {
}
}  // namespace executors

void spin(NodeBaseInterface::SharedPtr node) {
  ExecutorOptions options;
  options.context = node->get_context();
  executors::SingleThreadedExecutor executor(options);
  executor.add_node(node);
  executor.spin();
}
void spin(std::shared_ptr<Node> node) {
  spin(node->get_node_base_interface());
}
void spin_some(NodeBaseInterface::SharedPtr node) {
  ExecutorOptions options;
  options.context = node->get_context();
  executors::SingleThreadedExecutor executor(options);
  executor.add_node(node);
  executor.spin_some();
}
void spin_some(std::shared_ptr<Node> node) {
  spin_some(node->get_node_base_interface());
}
void spin_all(NodeBaseInterface::SharedPtr node, std::chrono::nanoseconds max_duration) {
  ExecutorOptions options;
  options.context = node->get_context();
  executors::SingleThreadedExecutor executor(options);
  executor.add_node(node);
  executor.spin_all(max_duration);
}
void spin_all(std::shared_ptr<Node> node, std::chrono::nanoseconds max_duration) {
  spin_all(node->get_node_base_interface(), max_duration);
}

}  // namespace rclcpp
