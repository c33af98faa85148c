// Which of the ready callbacks may be taken now, and by which worker.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_SELECTION_HPP_
#define TAKT_EXECUTORS_ENGINE_SELECTION_HPP_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "takt/executors/engine/record.hpp"
#include "takt/executors/executor.hpp"

namespace takt::detail {

/// Applies a rule and a workers' policy to the ready set: puts aside the callbacks that the rule
/// does not admit, until it admits more, and passes over those of other workers.
/// Thread safety: the constants from any thread; all else is serialised by the executor.
/// Real-time: nothing blocks or allocates.
class Selection {
 public:
  static constexpr std::size_t kAnyWorker = SIZE_MAX;

  Selection(const Rule* rule, const WorkersPolicy* policy, std::size_t workers)
      : rule_(rule),
        policy_(policy),
        is_needed_(rule != nullptr || policy != nullptr),
        is_logical_(rule != nullptr && rule->logical_outputs().has_value()),
        interrupts_(policy != nullptr && policy->interrupts()),
        running_(interrupts_ ? workers : 0) {}

  /// Whether a rule or a policy limits which callbacks a worker may take now.
  bool is_needed() const noexcept { return is_needed_; }
  /// Logical execution time: arrivals are looked at only when the rule opens.
  bool is_logical() const noexcept { return is_logical_; }
  bool counts() const noexcept { return policy_ != nullptr; }
  bool is_open() const noexcept { return rule_ == nullptr || rule_->is_open(); }

  /// True: the callback was put aside, or passed over.
  [[gnu::noinline]] bool puts_aside(CallbackRecord& record, std::size_t worker) noexcept;
  /// Whether the rule lets the callback be served now.
  bool admits(const CallbackRecord& record) const noexcept {
    return rule_ == nullptr || rule_->admits(record, record.settings.label);
  }
  /// True: it does not, so the callback was put aside.
  bool holds(CallbackRecord& record) noexcept;
  /// Takes the callbacks that were put aside, linked by next.
  ReadyCallback* take_held() noexcept;
  /// Takes those that were passed over, in the order in which they were.
  ReadyCallback* take_passed_over() noexcept {
    if (passed_over_ != nullptr) *end_of_passed_over_ = nullptr;
    return std::exchange(passed_over_, nullptr);
  }
  /// The release, or when the rule must look if that is earlier and a callback waits for the rule.
  /// With logical execution time always the latter.
  TimePoint release_or_opening(TimePoint release, bool has_waiting) const noexcept;

  /// A callback enters the scheduler (+1), or leaves it (-1).
  [[gnu::noinline]] void count(const ReadyCallback& callback, int change) noexcept;
  /// Whether a callback waits in the scheduler that this worker may take now.
  bool may_run(std::size_t worker) const noexcept {
    return !interrupts_ && waiting_for_[worker].load() != 0 && is_open();
  }

  // ---- Workers that interrupt each other ----

  bool interrupts() const noexcept { return interrupts_; }
  /// For control threads. Empty: nothing interrupts. Throws Error.
  std::vector<std::uint32_t> levels(std::span<const CallbackInfo> callbacks) const {
    return interrupts_ ? policy_->levels(callbacks) : std::vector<std::uint32_t>();
  }
  /// Any thread: whether the callback's level is above the ceilings of all that run.
  bool may_interrupt(const CallbackRecord& record) const noexcept {
    return record.level.load(std::memory_order_relaxed) > ceiling_.load();
  }
  /// The worker that may begin the callback now: the one after those that it interrupts; none if
  /// that worker is busy.
  std::optional<std::size_t> worker_for(const CallbackRecord& record) const noexcept;
  void begin(const CallbackRecord& record, std::size_t worker) noexcept;
  void end(std::size_t worker) noexcept;

 private:
  struct Running {
    ReadyCallback callback;
    std::uint32_t ceiling = 0;  // 0: the worker runs nothing
  };
  void set_ceiling() noexcept;

  const Rule* const rule_;
  const WorkersPolicy* const policy_;
  const bool is_needed_, is_logical_, interrupts_;
  std::vector<Running> running_;           // by worker
  std::atomic<std::uint32_t> ceiling_{0};  // the highest in running_
  ReadyCallback* held_ = nullptr;
  ReadyCallback* passed_over_ = nullptr;  // in order, for schedulers that take turns
  ReadyCallback** end_of_passed_over_ = nullptr;
  // Written at dispatch points; a worker that is about to sleep looks at its own.
  std::array<std::atomic<std::uint32_t>, kMostWorkers> waiting_for_{};
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_SELECTION_HPP_
