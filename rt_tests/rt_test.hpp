// What the programs of this folder have in common: rounds, a table, a verdict.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RT_TESTS_RT_TEST_HPP_
#define TAKT_RT_TESTS_RT_TEST_HPP_

#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/measuring/rounds.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt::rt {

/// One program, one question. It prints a table, what it expected of it, and the machine; with
/// `--json FILE` the same as JSON. The exit status is 0 when all expectations held, 1 when one did
/// not, 77 when the machine refuses the rights that the question needs, 2 for bad usage.
///
/// Expectations are relations between rows of the same run, never absolute times, because a shared
/// machine would break those. One about measured times fails only when the whole 95 % interval of
/// the paired ratio lies above its limit.
class RtTest {
 public:
  RtTest(int argc, char** argv, std::string question);

  /// Ends the program with 77 and the reason when SCHED_FIFO is refused.
  void needs_realtime();
  /// Ends the program with 77 and the reason.
  [[noreturn]] void skip(const std::string& reason);
  /// How many rounds, in which the rows alternate; `--rounds N` says otherwise.
  int rounds(int usual) const noexcept { return rounds_ != 0 ? rounds_ : usual; }

  /// A row of the table: a name, and numbers under the names of columns.
  void add(const std::string& row, const std::vector<std::pair<std::string, double>>& values);
  /// A relation that must hold, in words with its numbers.
  void expect(bool holds, const std::string& relation);
  /// `values` are at most `limit` times `to`: measurements of the same rounds, see paired_ratio.
  void expect_at_most(double limit, const std::vector<double>& values,
                      const std::vector<double>& to, const std::string& relation);
  /// Prints everything; the program's exit status.
  int finish();

 private:
  int report();
  struct Row {
    std::string name;
    std::vector<std::pair<std::string, double>> values;
  };
  std::string question_, json_;
  int rounds_ = 0;
  std::vector<Row> rows_;
  std::vector<std::pair<bool, std::string>> expectations_;
};

/// The last CPU under SCHED_FIFO with this priority.
ThreadAttributes realtime_thread(int priority, const std::string& name = "rt");

/// Keeps the calling thread busy for that much of its own CPU time.
void burn(Nanoseconds cpu_time) noexcept;

}  // namespace takt::rt

#endif  // TAKT_RT_TESTS_RT_TEST_HPP_
