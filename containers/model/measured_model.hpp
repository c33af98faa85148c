// Numbers that a run has measured of a system's callbacks, for the analysis of response times.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_MEASURED_MODEL_HPP_
#define TAKT_CONTAINERS_MODEL_MEASURED_MODEL_HPP_

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Times of one kind in a run. Zero: not known.
struct MeasuredTimes {
  Nanoseconds least{0}, p10{0}, median{0}, p90{0}, p99{0}, longest{0};

  /// Whether the percentiles are known, and not only the longest time.
  bool are_distributed() const noexcept {
    return median != Nanoseconds::zero() && p99 != Nanoseconds::zero();
  }
};

/// One callback in a run. Execution times are processor time, not wall-clock time.
struct MeasuredCallback {
  /// How many distances there are at most: δ⁻(2) to δ⁻(64).
  // Limit: arrivals in a row that a model has the distances of, less one. At it: longer rows follow
  // from these. Seen: nothing.
  static constexpr std::size_t kMostDistances = 63;

  std::string name;  // "/node/callback", as to_string(Chain::Step) writes it
  std::uint64_t executions = 0;
  Nanoseconds least_execution{0}, median_execution{0}, p99_execution{0}, longest_execution{0};
  /// The longest of the first ten executions, which often find cold caches. Zero: not known.
  Nanoseconds longest_first_execution{0};
  /// By how much, at most, an execution took longer than its CPU time, among executions that
  /// blocked: on a lock, a device, a reply or a sleep. nullopt: the model does not have it.
  std::optional<Nanoseconds> longest_wait;
  /// δ⁻(2), δ⁻(3), …: the minimum distance from the first to the last of 2, 3, … arrivals in a row.
  std::vector<Nanoseconds> least_distances;
  /// Zero unless the arrivals fit "every period, each up to jitter late".
  Nanoseconds period{0}, jitter{0};
  /// Arrivals that were overwritten: the distances between them are not known.
  std::uint64_t dropped = 0;
  /// Executions that no execution of another callback caused, and the minimum distances of their
  /// arrivals: their messages came from threads of components, other programs or services. None for
  /// timers.
  std::uint64_t uncaused = 0;
  std::vector<Nanoseconds> uncaused_distances;
  /// The most executions of other callbacks, by name, that one execution has caused.
  std::map<std::string, std::uint64_t> causes;
};

/// Latencies of a chain in a run: from the release of the first callback to the end of the last.
struct MeasuredChain {
  std::string name;
  std::uint64_t instances = 0;
  Nanoseconds median{0}, p99{0}, p999{0}, longest{0};
};

/// An executor in a run, and what it served.
struct MeasuredExecutor {
  std::string name, type, scheduler;
  std::vector<std::string> callbacks;
};

/// The identity of a component in a run: if it has changed, the numbers measured do not apply.
struct MeasuredComponent {
  std::string node;    // its full name
  std::string digest;  // of its class, its library and its parameters
};

/// The content of a *.model.yaml file.
struct MeasuredModel {
  std::string path;         // of this file, for messages; empty: it was not read from a file
  std::string file;         // the system file it was measured with
  std::string machine;      // for people: processors, kernel, clock
  Nanoseconds duration{0};  // of the shortest run
  /// Of all runs together; 0: there was one.
  Nanoseconds total_duration{0};
  /// Added to the longest execution times where they are used: 0.2 is a fifth.
  double margin = 0.2;
  /// Estimates from the trace: between two callbacks of a busy thread, and to wake an idle one;
  /// the longest is p99.9. Zero: the trace does not tell.
  MeasuredTimes dispatch_overhead, wake_overhead;
  /// Executions that the trace lost because its memory was full. Nothing follows from arrivals
  /// before and after them.
  std::uint64_t lost_executions = 0;
  std::vector<MeasuredCallback> callbacks;
  std::vector<MeasuredChain> chains;
  std::vector<MeasuredExecutor> executors;    // empty: the model does not tell
  std::vector<MeasuredComponent> components;  // empty: the model does not tell
  std::set<std::string> active_nodes;         // the lifecycle nodes that have been active
  /// See measured_settings(), and settings that the run had as options instead: "--transport".
  std::map<std::string, std::string> settings;
  /// How this machine or a component differs from those of the run, as the caller has found; empty:
  /// it does not. Not in the file.
  std::string differs;
  /// Where its callbacks and chains stand, by name.
  std::map<std::string, std::string> lines;
};

struct SystemDescription;

/// Settings of the file, beside its components, that may change execution times, by their place:
/// "/scan.durability". "{}": a map.
/// Thread safety: from any thread. Real-time: no.
std::map<std::string, std::string> measured_settings(const SystemDescription& system);

/// Reads a model file, which a person may have written.
/// Throws ConfigurationError with file and line.
/// Thread safety: from any thread. Real-time: no.
MeasuredModel read_measured_model(const std::string& path);

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_MEASURED_MODEL_HPP_
