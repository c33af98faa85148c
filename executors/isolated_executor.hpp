// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_
#define TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "takt/executors/executor.hpp"
#include "takt/executors/single_threaded_executor.hpp"
#include "takt/executors/wait_backend.hpp"

namespace takt {

/// One single-threaded executor, and one thread, for each node: no node delays another but by the
/// CPU (rclcpp's component_container_isolated). Children take the options' threads in order, then
/// cyclically, each named after its node; the thread that calls spin only waits for the end.
/// spin_some, spin_all, spin_once and spin_until_future_complete run the children one after
/// another on the caller.
/// Thread safety and real-time: as Executor. Adding a node while it spins starts a thread.
class IsolatedExecutor final : public Executor, private Wakeable {
 public:
  explicit IsolatedExecutor(const ExecutorOptions& options = {});
  ~IsolatedExecutor() override = default;

  void add_node(const std::shared_ptr<Node>& node) override;
  void remove_node(const std::shared_ptr<Node>& node) override;
  void add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                          const std::shared_ptr<Node>& node) override;
  void remove_callback_group(const std::shared_ptr<CallbackGroup>& group,
                             const std::shared_ptr<Node>& node) override;
  using Executor::spin;
  void spin(const ExceptionHandler& handler) override;
  void spin_once(Nanoseconds timeout) override;
  void spin_some(Nanoseconds max_duration) override;
  void spin_all(Nanoseconds max_duration) override;
  void cancel() noexcept override;
  bool is_spinning() const noexcept override { return spinning_.load(); }
  std::size_t max_threads() const noexcept override { return SIZE_MAX; }
  void release_timers(bool released) noexcept override;
  std::size_t pending() const noexcept override;
  std::vector<CallbackStatistics> statistics() const override;
  std::vector<ThreadStatistics> thread_statistics() const override;

 protected:
  FutureReturnCode spin_until_complete(FutureState& future, Nanoseconds timeout) override;

 private:
  struct Child {
    Child(const ExecutorOptions& options, const std::shared_ptr<Node>& for_node)
        : node(for_node), executor(options) {}
    std::weak_ptr<Node> node;
    SingleThreadedExecutor executor;
    std::thread thread;
  };
  class Spin;

  std::shared_ptr<Child> find(const Node& node) const;
  std::shared_ptr<Child> find_or_make(const std::shared_ptr<Node>& node);
  std::vector<std::shared_ptr<Child>> children() const;
  void start(Child& child);
  static void stop(Child& child) noexcept;
  bool run_one();
  template <class Done>
  void run_on_caller(TimePoint limit, Done&& done);
  void wake() noexcept override;

  const ExecutorOptions options_;
  const std::unique_ptr<WaitBackend> backend_;
  std::atomic<bool> spinning_{false}, cancelled_{false}, has_news_{false};

  mutable std::mutex mutex_;  // guards all below; control threads only
  std::vector<std::shared_ptr<Child>> children_;
  bool runs_children_ = false;  // each on its thread
  ExceptionHandler handler_;
  std::exception_ptr exception_;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_ISOLATED_EXECUTOR_HPP_
