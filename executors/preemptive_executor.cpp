// A more urgent callback preempts the one that runs. The threads have a band of SCHED_FIFO
// priorities on one CPU; a callback runs on the thread above that of the callback which it
// interrupts, so Linux runs it first. Baker's stack resource policy ("Stack-Based Scheduling of
// Realtime Processes", Real-Time Systems 1991) says which callback may interrupt which: none begins
// while one of its group runs, or while a more urgent one might have to wait for that group. So a
// callback that has begun never blocks, and no thread needs priority inheritance.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <thread>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/workers_policy.hpp"
#include "takt/sched/ranks.hpp"

namespace takt {
namespace {

class Preemptive final : public WorkersPolicy {
 public:
  explicit Preemptive(const ExecutorOptions& options)
      : scheduler_(options.scheduler),
        own_(options.scheduler_own),
        traits_(schedulers().traits(scheduler_)) {
    if (options.threads.size() <= 1) return;  // nothing interrupts
    check_order(options);
    check_band(options);
  }

  WorkerSet workers_of(const NamedCallback&, std::span<const ThreadAttributes>) const override {
    return ~WorkerSet{};
  }
  bool interrupts() const noexcept override { return true; }
  std::vector<std::uint32_t> levels(std::span<const CallbackInfo> callbacks) const override {
    std::vector<std::uint32_t> result;
    const std::vector<std::size_t> ranks = ranks_of(callbacks, scheduler_, own_);
    for (const std::size_t rank : ranks) {
      result.push_back(static_cast<std::uint32_t>(callbacks.size() - rank));
    }
    return result;
  }
  bool precedes(const ReadyCallback& a, const ReadyCallback& b) const noexcept override {
    return traits_.order == analysis::Order::by_urgency || point(a) < point(b);
  }

 private:
  TimePoint point(const ReadyCallback& callback) const noexcept {
    const std::optional<Nanoseconds> after = traits_.point(*callback.info);
    return after ? later(callback.ready_time, *after) : kNever;
  }
  void check_order(const ExecutorOptions& options) const {
    if (is_static(traits_)) return;
    std::string valid;
    for (const std::string& name : schedulers().names()) {
      if (!is_static(schedulers().traits(name))) continue;
      valid += (valid.empty() ? "" : ", ") + name;
    }
    throw Error(fmt::format("executor '{}' cannot interrupt by the order of '{}'", options.name,
                            scheduler_),
                fmt::format("choose a scheduler whose order is that of urgencies or of points in "
                            "time: {}",
                            valid));
  }
  static bool is_static(const SchedulerTraits& traits) noexcept {
    return traits.order == analysis::Order::by_urgency ||
           (traits.order == analysis::Order::by_point && traits.point != nullptr);
  }
  static void check_band(const ExecutorOptions& options) {
    const auto refuse = [&](const std::string& what) {
      throw Error(fmt::format("executor '{}': {}", options.name, what),
                  "give it a band on one CPU: {policy: SCHED_FIFO, priority: 60..68, affinity: "
                  "[0]}, in code each priority as a thread, the lowest first");
    };
    const ThreadAttributes* below = nullptr;
    for (const ThreadAttributes& thread : options.threads) {
      if (thread.policy != ThreadPolicy::fifo) refuse("its threads are not of SCHED_FIFO");
      if (thread.affinity.size() != 1 || thread.affinity != options.threads.front().affinity)
        refuse("its threads are not on one CPU");
      if (below != nullptr && thread.priority <= below->priority)
        refuse("a thread is not more urgent than the one before it");
      below = &thread;
    }
    if (options.realtime == Realtime::off || !is_granted(options.threads.front())) return;
    if (!is_granted(options.threads.back()))
      refuse("this user may have the lowest priority of its band, and not the highest");
  }
  // Asks Linux for the attributes, on a thread that ends at once.
  static bool is_granted(const ThreadAttributes& thread) {
    bool result = false;
    std::thread([&] {
      result = apply({.policy = thread.policy, .priority = thread.priority}, Realtime::prefer)
                   .refused.empty();
    }).join();
    return result;
  }

  const std::string scheduler_;
  const OwnValues own_;
  const SchedulerTraits traits_;
};

TAKT_REGISTER_EXECUTOR("preemptive", "a more urgent callback interrupts the one that runs",
                       .readiness = Readiness::events, .scheduler = "fixed_priority",
                       .max_threads = kMostWorkers, .takes_band = true,
                       .workers = make_workers_policy<Preemptive>)

}  // namespace
}  // namespace takt
