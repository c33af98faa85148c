// Describes the machine of a measurement, and what disturbed the measurement.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_MACHINE_HPP_
#define TAKT_MEASURING_MACHINE_HPP_

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/base/time.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt::rt {

/// The first line of a file; empty if it cannot be read.
std::string read_line(const std::string& path);

/// The preemption model of the kernel: "PREEMPT_RT", "PREEMPT_DYNAMIC (full)" and so on.
std::string preemption_model();

/// The machine block of every results file.
nlohmann::json machine_json();

/// The same in one line of text.
std::string machine_line();
/// Without what changes from minute to minute.
std::string lasting_part(const std::string& machine_line);

/// Keeps the calling thread, and the threads that it makes, on one of this process's CPUs: the
/// first is 0. Does nothing if there are fewer.
void stay_on(std::size_t cpu);

/// A thread, of another process where nothing else is said, under SCHED_FIFO, SCHED_RR or
/// SCHED_DEADLINE. Of the kernel, those that serve interrupts.
struct Neighbour {
  int process = 0, thread = 0;
  std::string name, policy;
  int priority = 0;
  std::vector<int> affinity;
  Nanoseconds cpu_time{0};  // during the observation
};

/// Those that there are now.
std::vector<Neighbour> realtime_neighbours();
/// Of this process.
std::vector<Neighbour> own_realtime_threads();

/// Whether a hypervisor runs this machine, which may take its CPUs away.
bool is_virtual();

/// Observes from its construction on which other threads use the CPUs.
/// Thread safety: none. Real-time: no; it reads /proc, so do not use it on the measured thread.
class Observation {
 public:
  Observation();
  struct Result {
    std::vector<Neighbour> neighbours;  // those that ran, the busiest first
    double steal_percent = 0;           // of all CPUs, taken by the host
    double load_average = 0;
  };
  Result so_far() const;

 private:
  std::map<int, Neighbour> before_;
  std::vector<std::uint64_t> cpu_before_;
};

nlohmann::json to_json(const Observation::Result& result);

}  // namespace takt::rt

#endif  // TAKT_MEASURING_MACHINE_HPP_
