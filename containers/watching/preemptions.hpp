// Preemptions of the threads of this process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_WATCHING_PREEMPTIONS_HPP_
#define TAKT_CONTAINERS_WATCHING_PREEMPTIONS_HPP_

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/watching/switch_records.hpp"

namespace TAKT_INTERNAL takt {

/// Finds each thread that preempts a thread of the system, or that is as urgent and has delayed
/// one, even if it has ended since: by perf_event_open(2) on each CPU, where Linux permits that.
/// Otherwise it observes coarsely: involuntary switches of the threads that no other thread of the
/// system may preempt. Thread safety: none. Real-time: no; where it is permitted, each switch of a
/// thread on these CPUs costs the kernel two records of 32 bytes.
class Preemptions {
 public:
  struct Found {
    /// The assumption that breaks, see assumption_kinds(): `nothing_else_runs`, also for an ended
    /// thread; `rt_runtime_as_here` for a thread without a real-time policy, which only throttling
    /// by Linux runs before real-time threads.
    const char* id = "nothing_else_runs";
    std::string by;      // "'stress' (process 123)"; empty: not known
    std::string thread;  // the preempted thread
    std::uint64_t count = 0;
  };

  Preemptions();
  ~Preemptions();
  Preemptions(const Preemptions&) = delete;
  Preemptions& operator=(const Preemptions&) = delete;

  /// `cpus`: where the real-time threads are going to run, some of which may not have begun yet.
  void begin(const std::vector<int>& threads, const std::set<int>& cpus);
  /// The preemptions since the last look, of the real-time threads among these.
  std::vector<Found> look(const std::vector<int>& threads);
  /// Why it observes only coarsely; empty: it does not.
  const std::string& note() const noexcept { return note_; }

 private:
  std::vector<Found> by_records(const std::vector<int>& threads);
  std::vector<Found> by_counts(const std::vector<int>& threads);

  std::vector<std::unique_ptr<SwitchRecords>> records_;  // by CPU; empty: observes coarsely
  std::map<int, std::uint64_t> counts_;                  // involuntary switches, by thread
  std::string note_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_WATCHING_PREEMPTIONS_HPP_
