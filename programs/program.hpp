// What the environment changes in a program: its executors, and who serves which node.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_PROGRAMS_PROGRAM_HPP_
#define TAKT_PROGRAMS_PROGRAM_HPP_

#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "takt/containers/container.hpp"
#include "takt/programs/results.hpp"
#include "takt/programs/simulated_program.hpp"
#include "takt/programs/template.hpp"

namespace takt::programs {

/// A spin of the program's that goes on until it is cancelled.
class LongSpin {
 public:
  virtual void cancel() = 0;
  /// Ends all that the program spins.
  virtual void shut_down() = 0;
  /// Whether what spins may go on.
  virtual bool is_valid() const = 0;

 protected:
  ~LongSpin() = default;
};

/// `TAKT_EXECUTOR` and `TAKT_SCHEDULER` name the type of every executor. `TAKT_CONFIG` names a file
/// whose `nodes` are served by its executors, not by those that the program adds them to:
/// 1. The first call that spins makes a container of those that have been added by then. Others are
///    loaded into it when they are added.
/// 2. It ends, and what a callback threw is thrown, before the last `spin()` returns; where the
///    program has only called `spin_some` and the like, at shutdown, with its nodes, or at exit.
///    Another spin then makes another one.
/// 3. A group or callback that nobody has is an error of 1, a node one of the main thread's first
///    `spin()`; where that never comes, of the exit.
/// `TAKT_CONFIG_TEMPLATE` names such a file, which is written at exit: see Template. `TAKT_RESULTS`
/// names one for what was measured, see Results; with `TAKT_TRACE` it has so many of the last
/// executions of each thread. `TAKT_NODES` names one for the nodes of TAKT_CONFIG, with
/// which the program ends: when all are to be served, or the main thread spins.
/// `TAKT_SIMULATE` makes the first `spin()` a simulation of the nodes of TAKT_CONFIG, with which
/// all spinning ends, see SimulatedProgram. Its results are what TAKT_RESULTS has then. Thread
/// safety: every method from any thread. Real-time: set-up only.
class Program {
 public:
  /// Reads the environment at its first call, of which init makes one. Throws Error.
  static Program& instance();

  /// With the type and the scheduler of the environment, if it has them.
  std::unique_ptr<Executor> make_executor(const std::string& type, ExecutorOptions options);
  /// It spins no more.
  void ends(const Executor& executor) noexcept;

  /// Whether executors of the file serve it, or this group of it.
  bool serves(const Node& node, const CallbackGroup* group = nullptr) const;
  /// Whether an executor of the program must remove it. A static one keeps what it has until it
  /// goes, as it could only refuse.
  bool removes(const Node& node, const CallbackGroup* group = nullptr) const;
  bool is_serving() const noexcept { return is_serving_.load(); }

  /// A node of the program, which makes or drops it.
  void made(const std::shared_ptr<const Node>& node);
  void gone(const Node& node) noexcept;
  /// It, or this group of it, is to be added to an executor, for the first time or again. False:
  /// one of the file serves it.
  bool add(const std::shared_ptr<Node>& node, const Executor& executor,
           const CallbackGroup* group = nullptr);

  /// nullptr: a short one.
  void begin_spin(LongSpin* spin);
  /// Throws what a callback threw.
  void end_spin(const LongSpin& spin);
  /// Of one that is not long.
  void has_spun() noexcept;
  /// Lets the container end, without waiting.
  void cancel() noexcept;

 private:
  Program();
  void read_file(const std::string& how_to_simulate);
  void simulate(LongSpin* spin);
  ContainerOverrides overrides() const;
  const ComponentDescription* find(const std::string& name) const;
  void check_nodes() const;
  bool has_all_nodes() const;
  [[noreturn]] void describe_nodes() const;
  void start();
  void stop();
  void on_failure();
  void join();
  int at_exit() noexcept;  // the status of what is wrong, or 0

  struct Variables {
    std::string executor, placement, scheduler, nodes, results;
    std::size_t trace_events = 0;
  };
  Variables variables_;
  std::optional<SystemDescription> file_;
  std::atomic<bool> is_serving_{false};

  mutable std::mutex mutex_;  // guards all below; nothing of the program's runs under it
  std::multimap<std::string, std::weak_ptr<const Node>> made_;  // all nodes that there have been
  std::vector<std::weak_ptr<Node>> added_;
  std::vector<LongSpin*> spinning_;
  std::shared_ptr<Container> container_;
  bool is_ending_ = false;  // a thread waits for the end of one
  std::condition_variable ended_;
  bool is_over_ = false;  // it ends, as a callback has thrown or a context was shut down
  std::optional<Template> template_;
  std::optional<Results> results_;
  std::unique_ptr<SimulatedProgram> simulated_;
  std::set<std::string> notes_;  // that have been printed
};

}  // namespace takt::programs

#endif  // TAKT_PROGRAMS_PROGRAM_HPP_
