// What ran when in a run of a system: read from its result, or from a file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TRACE_HPP_
#define TAKT_TOOLS_TAKT_TRACE_HPP_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/base/time.hpp"
#include "takt/base/trace_clock.hpp"
#include "takt/containers/watching/scheduling.hpp"
#include "takt/measuring/run.hpp"

namespace takt::tools {

/// One execution of a callback. Times count from the begin of the trace.
struct TracedExecution {
  std::size_t thread = 0;      // in Trace::threads
  std::string callback, kind;  // "/node/callback", "timer"
  std::uint64_t sequence = 0, chain_instance = 0;
  std::uint64_t lost = 0;  // messages overwritten, or releases missed, since the last one
  Nanoseconds ready{0}, picked{0}, start{0}, end{0};
  Nanoseconds cpu_time{0};
  bool has_waited = false;           // it gave up the CPU by itself
  std::optional<std::size_t> cause;  // the execution that published its message
};

struct TracedThread {
  std::string process, name;
  int tid = 0;
  std::uint64_t overwritten = 0;  // its oldest executions, which are not in the trace
  /// Whether it has run what was ready as soon as Linux and the executor could: it is a real-time
  /// thread, and no trigger and no period held it.
  bool is_prompt = false;
};

/// What Linux did on a CPU, from then on: it ran another thread, 0 being none; or one woke another.
struct TracedSwitch {
  Nanoseconds time{0};
  int cpu = 0;
  std::uint32_t thread = 0, next_thread = 0;
  bool was_preempted = false, is_wakeup = false;
};

/// From `end` on, what a thread picks is served as this mode says.
struct TracedMode {
  std::string process, mode, cause;
  Nanoseconds begin{0}, end{0};
};

/// The machine of a trace that no run has made.
inline constexpr const char* kSimulatedMachine = "simulated";

struct Trace {
  /// What else is known of the run: file, duration_s, machine, callbacks, chains; of the times:
  /// clock, and begin_ns, which is 0 of the trace.
  nlohmann::json about;
  std::vector<TracedThread> threads;
  std::vector<TracedExecution> executions;     // sorted by start
  std::vector<TracedMode> modes;               // read_trace leaves them out, too
  std::vector<TracedSwitch> switches;          // sorted by time; read_trace leaves them out
  std::map<std::uint32_t, std::string> names;  // of threads in these
  std::string missing;                         // of the switches, and why
};

/// When a trace was recorded, by which clock, and what Linux did then.
struct TraceFrame {
  std::string clock = "monotonic";
  TimePoint begin{}, end{};                    // of CLOCK_MONOTONIC
  Nanoseconds begin_offset{0}, end_offset{0};  // of the clock from that, then
  Scheduling::Seen scheduling;

  /// A time of CLOCK_MONOTONIC, by the clock: what that is corrected is spread evenly.
  Nanoseconds on_clock(Nanoseconds monotonic) const;
};

/// Records it from its construction on. Thread safety: none.
class TraceRecorder {
 public:
  /// Throws Error if there is no such clock.
  explicit TraceRecorder(const std::string& clock);
  TraceFrame end();

 private:
  const TraceClock clock_;
  TraceFrame frame_;
  Scheduling scheduling_;
};

/// Of a run that has one. `is_held`: a trigger or a period decides when the executor of this thread
/// runs.
Trace make_trace(const rt::Run& run, bool has_several_processes,
                 const std::function<bool(const rt::Run::Traced&)>& is_held,
                 const TraceFrame& frame);

/// In Chrome's Trace Event Format, as write_trace writes it.
nlohmann::json trace_json(const Trace& trace);

/// Writes it in Chrome's Trace Event Format, for the viewers of Perfetto (ui.perfetto.dev) and
/// Chrome (chrome://tracing): a slice for each execution on its thread, below it the time in the
/// ready queue, an arrow from each step of a chain to the next, a mark where messages were
/// overwritten or releases missed, and a counter for each callback for which more than one has
/// waited; then a row for each CPU with the threads that ran there, and marks where one of the
/// trace's was woken. Throws Error if the file cannot be written.
void write_trace(const Trace& trace, const std::string& path);

/// Reads a file of write_trace. Throws Error if it is none.
Trace read_trace(const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_TRACE_HPP_
