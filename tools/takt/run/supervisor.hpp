// Supervises the child processes of a run: starts, controls, restarts and ends them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SUPERVISOR_HPP_
#define TAKT_TOOLS_TAKT_SUPERVISOR_HPP_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/container.hpp"

#include "run/end_signals.hpp"

namespace takt::tools {

/// The parent of the processes of a run. Prints their output with their names.
class Supervisor {
 public:
  /// Each process is this program again: with the words of its command line, its own name and its
  /// end of the connection, see RunOptions::words.
  Supervisor(const std::vector<SystemDescription>& processes, std::vector<std::string> words,
             const EndSignals& signals);
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Sends the command to all children, then returns their responses; without a command, the
  /// documents that they send at their start. Throws Error if a child has ended.
  std::vector<nlohmann::json> hear();
  std::vector<nlohmann::json> ask(const std::string& word);
  void ask_to_match(const std::vector<std::vector<std::uint64_t>>& wanted);

  /// Releases the first timers. A child that ends from here on is restarted as in `watch`.
  void release();

  /// From now on, kills a child that does not end or respond in time: a callback may hang, or it
  /// may wait forever for a lock in shared memory that a killed process held.
  void bound_end(bool uses_shared_memory);

  /// The signal that has ended watch(); 0: none.
  int signal() const noexcept { return signal_; }
  /// Runs for this time, until a signal arrives, or until no child is left. Restarts a child that
  /// ends if its description demands it; the others continue, however long its constructors take.
  void watch(Nanoseconds duration);

  /// How children ended; and the same for those that were not restarted.
  const std::vector<std::string>& deaths() const noexcept { return deaths_; }
  std::vector<std::string> failures() const;
  bool are_complete() const noexcept { return deaths_.empty(); }

 private:
  struct Child;
  void begin(Child& child);
  void restart(Child& child);
  void go_on(Child& child);
  std::optional<nlohmann::json> answer_of(Child& child);
  nlohmann::json hear(Child& child);
  void wait_for(const Child& child);
  void hurry();
  void pump(Nanoseconds most);
  bool end_some();
  void say_who_is_unmade() const;
  void end_now(const std::string& why);
  static void forget(Child& child);
  static bool is_gone(const Child& child);
  static void await_end(Child& child);
  std::string end_of(Child& child);
  void handle_end(Child& child);

  const std::vector<std::string> words_;
  const EndSignals& signals_;
  TimePoint limit_ = kNever;
  std::vector<std::unique_ptr<Child>> children_;
  std::vector<std::string> deaths_;
  int signal_ = 0;  // that has ended the run; 0: none
  bool has_run_ = false, is_ending_ = false, is_hurried_ = false;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SUPERVISOR_HPP_
