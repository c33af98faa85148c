// A run in results, and its form as JSON: docs/reference/results.schema.json is made of it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MEASURING_RUN_HPP_
#define TAKT_MEASURING_RUN_HPP_

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/result.hpp"

namespace takt::rt {

/// What one run has measured, in all its processes. measuring/run_fields.hpp says what each field
/// means.
struct Run {
  using Callback = ProcessResult::Callback;
  using Chain = ProcessResult::ChainResult;
  using Executor = ProcessResult::UsedExecutor;
  struct Thread {
    std::string process, executor, name;
    ThreadAttributes asked;
    ThreadState in_force;
    double cpu_percent = 0, spin_percent = 0;
    std::uint64_t wakeups = 0;
  };
  struct Process {
    std::string name;
    std::uint64_t pss_kb = 0;
    double cpu_percent = 0;
    std::optional<std::uint64_t> allocations_while_spinning, allocations_in_dds;
  };
  /// An end of a topic.
  struct Topic {
    std::string process, topic, type;
    bool is_writer = false, is_reliable = false;
    std::uint64_t matched = 0, messages = 0;
    std::string transport;
    std::uint64_t uncopied = 0, lost = 0;
    bool operator==(const Topic&) const = default;
  };
  struct Releases {
    std::uint64_t due = 0, served = 0;
  };
  /// The executions of a thread, in the order of NamedTraceEvent.
  struct Traced {
    std::string process, executor, executor_type, scheduler, thread;
    int tid = 0;
    bool is_realtime = false;
    std::uint64_t overwritten = 0;
    nlohmann::json events;
  };

  std::string file, executor = "file", placement = "file", scheduler = "file", composition = "file",
                    transport = "auto";
  double duration_s = 0;
  std::uint64_t repeat = 0;
  std::vector<Callback> callbacks;
  std::vector<Chain> chains;
  std::vector<Executor> executors;
  std::vector<Thread> threads;
  std::vector<Process> processes;
  std::vector<Topic> topics;
  std::optional<std::vector<ProcessResult::Deviation>> deviations;
  std::vector<ProcessResult::ModeSwitch> mode_switches;
  std::vector<std::string> active_nodes;
  std::vector<std::string> notes;
  std::optional<std::vector<Traced>> trace;
  std::optional<nlohmann::json> over_time;

  /// Of all timers.
  Releases releases() const;
};

/// Of one process, or of several put together, without the options of the run.
Run run_of(ProcessResult process);

/// An entry of "runs". Buckets of histograms are lists of [bucket, count], see base/histogram.hpp.
nlohmann::json run_json(const Run& run, bool with_buckets = true);
/// Throws Error, which begins with `where`, if the run lacks a key, but for those that an earlier
/// Takt did not write, or if a value is none that a run can have. Without buckets, histograms are
/// empty.
Run read_run(const nlohmann::json& run, std::string_view where);
/// Of a document: the runs of a Takt.
std::vector<Run> read_runs(const nlohmann::json& document, std::string_view where);

/// The whole document: version, machine, runs.
nlohmann::json result_document(const std::vector<Run>& runs, bool with_buckets = true);

/// The largest time in µs of each bucket of the histograms, by its number.
nlohmann::json bucket_limits_us();

/// Of an entry of "runs".
nlohmann::ordered_json run_schema();

}  // namespace takt::rt

#endif  // TAKT_MEASURING_RUN_HPP_
