// A program under a virtual clock, for `takt simulate FILE -- PROGRAM`.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_PROGRAMS_SIMULATED_PROGRAM_HPP_
#define TAKT_PROGRAMS_SIMULATED_PROGRAM_HPP_

#include <functional>
#include <memory>
#include <string>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/simulation/simulation.hpp"

namespace takt::programs {

/// It begins with rclcpp::init, whose clock is the process' from then on, and ends when the
/// program's spin() does. In between its code runs on the calling thread, and in callbacks on the
/// executors' threads, one at a time. What is not under the clock ends the process: threads, sleeps
/// and clocks of its own, which libtakt_simulated.so sees when they are called; and what waits in
/// the layer for rclcpp, see refuse().
/// Thread safety: one thread. Real-time: no.
class SimulatedProgram {
 public:
  /// `how`: JSON of `takt simulate`. Throws Error for what cannot be simulated.
  SimulatedProgram(const std::string& how, const std::string& path_of_file,
                   ContainerOverrides overrides);

  const SystemDescription& file() const noexcept { return file_; }
  bool has_run() const noexcept { return has_run_; }
  /// From the first release to the end. Throws Error if something cannot be simulated; rethrows
  /// what a callback throws.
  void run(const std::string& results);

 private:
  const SystemDescription file_;
  Scenario scenario_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<ManualClock> clock_;  // never destroyed: all nodes have it
  bool has_run_ = false;
};

/// Whether the process is a program that is simulated.
/// Thread safety: from any thread.
bool is_simulated() noexcept;
/// If so, ends it: it cannot be, because it `does` so.
/// Thread safety: from any thread.
void refuse(const std::string& does) noexcept;

}  // namespace takt::programs

#endif  // TAKT_PROGRAMS_SIMULATED_PROGRAM_HPP_
