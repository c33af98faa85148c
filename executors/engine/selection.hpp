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

/// What a rule and a workers' policy say of the ready set: it puts aside what the rule does not
/// admit, until the rule admits more, and passes over what other workers may take.
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

  /// Not each worker may take each callback at any time.
  bool is_needed() const noexcept { return is_needed_; }
  /// Nothing is looked at before the rule opens.
  bool is_logical() const noexcept { return is_logical_; }
  bool counts() const noexcept { return policy_ != nullptr; }
  bool is_open() const noexcept { return rule_ == nullptr || rule_->is_open(); }

  /// True: it is put aside, or passed over.
  [[gnu::noinline]] bool puts_aside(CallbackRecord& record, std::size_t worker) noexcept;
  /// The rule may admit it later: then it is put aside, and true.
  bool holds(CallbackRecord& record) noexcept;
  /// What was put aside, linked by next; from here on nothing is.
  ReadyCallback* take_held() noexcept;
  /// The same of what was passed over.
  ReadyCallback* take_passed_over() noexcept {
    if (passed_over_ != nullptr) *end_of_passed_over_ = nullptr;
    return std::exchange(passed_over_, nullptr);
  }
  /// The first release, or when the rule must look before. That matters only to what waits for it.
  TimePoint release_or_opening(TimePoint release, bool has_waiting) const noexcept;

  /// The callback has come into the scheduler, or left it.
  [[gnu::noinline]] void count(const ReadyCallback& callback, int change) noexcept;
  /// A callback waits there that this worker may take now.
  bool may_run(std::size_t worker) const noexcept {
    return !interrupts_ && waiting_for_[worker].load() != 0 && is_open();
  }

  // ---- Workers that interrupt each other ----

  bool interrupts() const noexcept { return interrupts_; }
  /// Control threads. Empty: there are none. Throws Error.
  std::vector<std::uint32_t> levels(std::span<const CallbackInfo> callbacks) const {
    return interrupts_ ? policy_->levels(callbacks) : std::vector<std::uint32_t>();
  }
  /// Any thread: it need not wait for the end of what runs.
  bool may_interrupt(const CallbackRecord& record) const noexcept {
    return record.level.load(std::memory_order_relaxed) > ceiling_.load();
  }
  /// The one worker that may begin it now, if that is idle: the next after those that it
  /// interrupts.
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
  std::atomic<std::uint32_t> ceiling_{0};  // the highest of them
  ReadyCallback* held_ = nullptr;
  ReadyCallback* passed_over_ = nullptr;  // in their order, as a scheduler may serve in turns
  ReadyCallback** end_of_passed_over_ = nullptr;
  // Written at dispatch points; a worker that is about to sleep looks at its own.
  std::array<std::atomic<std::uint32_t>, kMostWorkers> waiting_for_{};
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_SELECTION_HPP_
