// The file that TAKT_RESULTS asks for: the measurements of the program.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_PROGRAMS_RESULTS_HPP_
#define TAKT_PROGRAMS_RESULTS_HPP_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/containers/result.hpp"

namespace takt::programs {

/// Sums what executors of one type have measured, as a program may make one for each call of
/// `spin_some`; and the containers of TAKT_CONFIG. Written as `takt run --json --histograms` does.
/// Thread safety: none. Real-time: no.
class Results {
 public:
  /// `trace_events`: kept of each thread. Throws Error if the file cannot be written: before
  /// the run, as it would be in vain.
  Results(const std::string& path, std::size_t trace_events);

  /// The first spin begins: so does the measured time.
  void spins();
  /// A spin has ended: so has the measured time, unless there is another one. Memory is measured
  /// where the spin is long.
  void has_spun(bool is_long);
  void made(const Executor& executor, const std::string& type, const std::string& scheduler);
  /// An executor is to serve it.
  void added(const std::shared_ptr<Node>& node);
  void ends(const Executor& executor);
  void add(const ProcessResult& part);
  /// That it cannot be asked.
  void note_spinning(const std::string& executor);
  /// The names are of the environment. Throws Error if it cannot be written.
  void write(const std::string& executor, const std::string& placement,
             const std::string& scheduler);

 private:
  struct Kind {
    std::string executor, scheduler;
  };
  void note(const std::string& text);
  std::uint64_t waiting(const CallbackStatistics& of) const;

  const std::string path_;
  const std::size_t trace_events_;
  const std::uintmax_t size_before_;
  std::map<const Executor*, Kind> executors_;
  std::vector<std::weak_ptr<Node>> nodes_;
  ProcessResult sum_;
  TimePoint begin_{};
  Nanoseconds cpu_time_before_{0};
};

/// Every node has services for its parameters. They are not shown.
bool is_parameter_service(const std::string& node, EntityKind kind, const std::string& name);

}  // namespace takt::programs

#endif  // TAKT_PROGRAMS_RESULTS_HPP_
