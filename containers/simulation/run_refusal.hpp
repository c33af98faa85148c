// Why a simulation that is under way cannot go on.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_RUN_REFUSAL_HPP_
#define TAKT_CONTAINERS_SIMULATION_RUN_REFUSAL_HPP_

#include <cstdint>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "takt/base/manual_clock.hpp"

namespace takt {

/// Thread safety: one thread at a time. Real-time: no.
class RunRefusal {
 public:
  // Limit: executions and arrivals from outside in a second of a simulation, and periods of an
  // executor with `let`. At it: the simulation ends. Seen: the error, with the name.
  static constexpr std::int64_t kMostInASecond = 1'000'000;

  explicit RunRefusal(ManualClock& clock) : clock_(clock) {}

  /// An execution of this callback, or an arrival from outside.
  void count(const std::string& callback) {
    if (clock_.now() >= end_of_second_) {
      end_of_second_ = later(clock_.now(), std::chrono::seconds(1));
      count_ = 0;
    }
    if (++count_ <= kMostInASecond) return;
    refuse(fmt::format("more than {} executions and arrivals in a second, as of '{}'",
                       kMostInASecond, callback),
           "let less come at once, and give longer periods and executions");
  }
  /// It runs, and nobody says for how long.
  void runs_without_time(const std::string& callback) {
    refuse(fmt::format("'{}': its execution time is not known", callback),
           "declare it (`execution`), or measure it (`takt model`)");
  }
  /// The run is over: threads end now, and need the clock for that.
  void end() noexcept { has_ended_ = true; }

  /// The first cause; empty: none.
  const std::string& what() const noexcept { return what_; }
  const std::string& instead() const noexcept { return instead_; }

 private:
  void refuse(std::string what, std::string instead) {
    if (has_ended_ || !what_.empty()) return;
    what_ = std::move(what);
    instead_ = std::move(instead);
    // The advance() that is under way ends before what else happens at this instant.
    clock_.end_by(later(clock_.now(), Nanoseconds(-1)));
  }

  ManualClock& clock_;
  TimePoint end_of_second_{};
  std::int64_t count_ = 0;
  bool has_ended_ = false;
  std::string what_, instead_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_RUN_REFUSAL_HPP_
