// The processes of a run, as their parent sees them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CHILDREN_HPP_
#define TAKT_TOOLS_TAKT_CHILDREN_HPP_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/container.hpp"

#include "run/end_signals.hpp"

namespace takt::tools {

/// Starts the processes of a run, talks with them, and ends them. What they write comes out with
/// their names.
class Children {
 public:
  Children(const std::vector<SystemDescription>& processes, const ContainerOverrides& overrides,
           const EndSignals& signals);
  ~Children();
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// What each says to begin with, or answers to the command. All are asked before any is heard.
  /// Throws Error when one has ended.
  std::vector<nlohmann::json> hear();
  std::vector<nlohmann::json> ask(const std::string& word);
  void ask_to_match(const std::vector<nlohmann::json>& wanted);

  /// From here on a child that does not end, or answer, in time is killed: one that publishes may
  /// wait for a lock in shared memory that a killed process has kept.
  void bound_end();

  /// Until the time is up, a signal comes, or none is left. One that ends meanwhile is started
  /// again, as its description says; the others go on, however long its constructors take.
  void watch(Nanoseconds duration);

  /// The children that have ended, and how; and of these, the ones that were not started again.
  const std::vector<std::string>& deaths() const noexcept { return deaths_; }
  std::vector<std::string> failures() const;
  bool are_complete() const noexcept { return deaths_.empty(); }

 private:
  struct Child;
  void begin(Child& child);
  void begin_again(Child& child);
  void go_on(Child& child);
  std::optional<nlohmann::json> answer_of(Child& child);
  nlohmann::json hear(Child& child);
  void pump(Nanoseconds most);
  bool end_some();
  std::string unmade_children() const;
  template <class Predicate>
  void end_now(Predicate is_meant, const std::string& why);
  static void forget(Child& child);
  std::string end_of(Child& child);
  void bury(Child& child);

  const ContainerOverrides overrides_;
  const EndSignals& signals_;
  TimePoint limit_ = kNever;
  std::vector<std::unique_ptr<Child>> children_;
  std::vector<std::string> deaths_;
  bool has_run_ = false, is_ending_ = false;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CHILDREN_HPP_
