// Common parts of the real-time tests: rounds, a table, expectations.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RT_TESTS_RT_TEST_HPP_
#define TAKT_RT_TESTS_RT_TEST_HPP_

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/measuring/rounds.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt::rt {

/// A test program answers one question. It prints a table, its expectations and the machine;
/// `--json FILE` writes the same as JSON. The exit status is 0 if all expectations hold, 1 if one
/// does not, 77 if the machine refuses required privileges, and 2 for wrong usage.
///
/// Expectations compare rows of the same run. They contain no absolute times, which would fail on a
/// shared machine. A comparison of measured times fails only if the whole 95 % interval of the
/// paired ratio lies above its limit.
class RtTest {
 public:
  RtTest(int argc, char** argv, std::string question);

  /// Exits with 77 and the reason if SCHED_FIFO is refused.
  void needs_realtime();
  /// Exits with 77 and the reason.
  [[noreturn]] void skip(const std::string& reason);
  /// Number of rounds, in which the rows alternate; `--rounds N` overrides it, and so does the
  /// environment's TAKT_ROUNDS=N.
  int rounds(int usual) const noexcept { return rounds_ != 0 ? rounds_ : usual; }

  /// Adds a row to the table: its name, and values by column.
  void add(const std::string& row, const std::vector<std::pair<std::string, double>>& values);
  /// Adds an expectation: whether it holds, and its description with the numbers.
  void expect(bool holds, const std::string& relation);
  /// Adds the expectation that `values` are at most `limit` times `to`, which are measurements of
  /// the same rounds; see paired_ratio.
  void expect_at_most(double limit, const std::vector<double>& values,
                      const std::vector<double>& to, const std::string& relation);
  /// Prints everything and returns the exit status.
  int finish();

 private:
  [[noreturn]] void print_help(std::string_view program) const;
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

/// Attributes: SCHED_FIFO with this priority on the last CPU.
ThreadAttributes realtime_thread(int priority, const std::string& name = "rt");

/// Keeps the calling thread busy for this much CPU time.
void burn(Nanoseconds cpu_time) noexcept;

}  // namespace takt::rt

#endif  // TAKT_RT_TESTS_RT_TEST_HPP_
