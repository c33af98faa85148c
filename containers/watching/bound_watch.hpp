// Compares a running system with the assumptions of its analysis: `takt run --watch-bounds`.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_WATCHING_BOUND_WATCH_HPP_
#define TAKT_CONTAINERS_WATCHING_BOUND_WATCH_HPP_

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/result.hpp"
#include "takt/containers/watching/node_changes.hpp"
#include "takt/containers/watching/preemptions.hpp"
#include "takt/containers/watching/sent_messages.hpp"
#include "takt/entities/execution_watch.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_INTERNAL takt {

/// Sets the limits of each callback, see ExecutionWatch. look() compares the rest: chains, losses,
/// and the kernel's counters of threads and CPUs.
///
/// Not observable: a callback that blocks longer than was assumed, unless a bound breaks.
/// Thread safety: none; `look` and `begin` from one thread.
/// Real-time: no; only ExecutionWatch is on threads that run callbacks.
class BoundWatch {
 public:
  /// Construct it before executors run the callbacks.
  BoundWatch(const SystemModel& model, const ModelBounds& bounds, const ModelledProcess& process);

  /// Sets the baseline of all counters. `threads`: those that run callbacks.
  void begin(const std::vector<int>& threads);
  /// Call it before the statistics for `look` are read: what was sent by now is compared with them.
  void count_messages() { sent_.count(); }
  /// Finds deviations since the last look, and logs the first one of each kind. `is_over`: no timer
  /// is served any more, so waiting releases are not lost.
  void look(const std::vector<int>& threads, const std::vector<CallbackStatistics>& callbacks,
            const std::vector<std::shared_ptr<Chain>>& chains, bool is_over);
  /// Somebody has loaded a component, unloaded one, or changed parameters of callbacks.
  void changed(const std::string& what);
  /// The system differs from the file.
  void differs(const std::string& what);
  /// A thread that runs callbacks did not get what the file asks for.
  void refused(const std::string& thread, const std::string& why);

  const std::vector<ProcessResult::Deviation>& found() const noexcept { return found_; }
  /// Why preemptions are only observed coarsely; empty: they are not.
  const std::string& note() const noexcept { return preemptions_.note(); }

 private:
  struct Watched {
    std::string name;
    std::vector<std::string> chains;                // whose bounds depend on the callback
    std::string times, arrivals;                    // ids of the assumptions about these
    std::vector<std::string> must_keep;             // chains through the callback that lose nothing
    std::optional<analysis::ArrivalCurve> outside;  // arrivals from outside the file; none: nothing
    std::uint64_t from_outside = 0;                 // at the last comparison
    TimePoint compared{};
    std::shared_ptr<ExecutionWatch> watch;
    Nanoseconds bound{0};    // 0: none
    bool is_silent = false;  // the analysis has no arrivals for it
    bool is_exact = false;   // its component says how long it works
    std::weak_ptr<Entity> entity;
  };
  struct WatchedChain {
    Nanoseconds bound{0};
    std::string first;   // its first callback
    bool keeps = false;  // none of its instances is lost, or joined with others
  };
  struct Ticks {
    std::uint64_t interrupts = 0, stolen = 0;
  };
  struct Figures {
    std::map<int, std::uint64_t> page_faults;  // by thread
    std::map<int, ThreadState> attributes;     // by thread
    std::map<int, Ticks> ticks;                // by CPU
    RealtimeGrant granted;
    Nanoseconds turn{0};
  };

  void look_at_callback(Watched& callback, const CallbackStatistics& counted, bool is_over);
  void look_at_what_is_new(const CallbackStatistics& counted);
  void look_at_what_waits(const Watched& callback);
  void look_at_what_was_sent(const std::vector<CallbackStatistics>& callbacks);
  void look_at_what_comes_from_outside(Watched& callback, std::uint64_t count);
  void look_at_chain(const Chain& chain, const std::vector<CallbackStatistics>& callbacks);
  void look_at_machine(const std::vector<int>& threads);
  void look_at_threads(const Figures& now);
  void look_at_cpus(const Figures& now);
  /// Adds a deviation, or updates it. `count`: how often it has been seen in all.
  void report(const std::string& id, const std::string& of, const std::string& text,
              std::uint64_t count, const std::vector<std::string>& chains);
  static Figures figures(const std::vector<int>& threads);
  static std::map<int, Ticks> ticks_of_cpus();
  std::uint64_t counted_so_far(const char* kind, const std::string& what, std::uint64_t more);

  std::vector<Watched> callbacks_;
  std::map<std::string, WatchedChain> chains_;
  std::vector<std::string> all_;  // the names of `chains_`
  NodeChanges changes_;
  SentMessages sent_;
  Preemptions preemptions_;
  std::set<int> cpus_;  // of the real-time threads
  Figures before_;
  std::map<std::pair<std::string, std::string>, std::uint64_t> counts_;
  std::vector<ProcessResult::Deviation> found_;
  std::optional<std::size_t> others_;  // in found_: those beyond the limit
  std::map<std::pair<std::string, std::string>, std::size_t> places_;  // in found_, by id and what
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_WATCHING_BOUND_WATCH_HPP_
