// A configuration file whose response times are bounded.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_ANALYZED_FILE_HPP_
#define TAKT_TOOLS_TAKT_ANALYZED_FILE_HPP_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/containers/container.hpp"

#include "analyze/program_nodes.hpp"

namespace takt::tools {

/// What simulations of a system have shown, as `takt simulate --search` runs them.
struct SimulatedChains {
  struct Chain {
    std::string name;
    Nanoseconds longest{0};  // 0: it had no instances
    std::string scenario;    // in which it took so long
    std::string command;     // that repeats this
  };
  std::uint64_t runs = 0;
  int signal = 0;        // came before all runs that were asked for
  std::string duration;  // of each
  std::string why_not;   // they cannot be; empty: they were
  std::vector<std::string> notes;
  std::vector<Chain> chains;
  nlohmann::json worst_schedule;  // for a report; null: none was asked for

  /// nullptr: nothing is known of it.
  const Chain* find(std::string_view name) const;
};

/// A system with its model and its bounds. The components are constructed; nothing runs.
struct AnalyzedFile {
  SystemDescription system;
  std::shared_ptr<const ProgramNodes> program;
  std::vector<std::unique_ptr<Container>> containers;
  std::optional<MeasuredModel> measured;
  MachineFacts machine;
  std::vector<PlannedChain> chains;
  std::vector<ModelledProcess> processes;
  SystemModel model;
  ModelBounds bounds;
  Nanoseconds analysis_time{0};  // what `bounds` took
  /// Of the file's `modes:`. What is above is the mode normal.
  struct Mode {
    std::string name;
    SystemModel model;
    ModelBounds bounds;
  };
  std::vector<Mode> modes;
  std::optional<SimulatedChains> simulated;

  /// Whether there are chains, and each has a deadline and meets it for sure, in each mode that
  /// does not drop it.
  bool is_all_guaranteed() const;
  /// Whether a run has shown that a deadline is missed, or a bound wrong.
  bool is_contradicted() const;
  /// Whether `analysis: {watch: true}` is possible: each process knows only its part.
  bool may_be_watched() const { return processes.size() == 1 && program == nullptr; }
  /// What a run has shown of a chain; nullptr: nothing.
  const MeasuredChain* observed(const SystemModel::Chain& chain) const;
};

struct AnalyzeOptions {
  std::string model;             // a file; empty: the one that the system names
  std::string as;                // as for `takt run`
  ContainerOverrides overrides;  // executor and scheduler
  Settings settings;             // instead of what the file says
  nlohmann::json nodes;          // of nodes_of_program; null: the file has components
  bool measures_overheads = false;
  std::optional<MachineFacts> machine;  // instead of what is looked up here
  std::uint64_t simulated_runs = 0;     // to look for deadlines that are missed; 0: none
  bool draws_schedule = false;          // of the worst of them
};

/// Throws Error for a bad file.
AnalyzedFile analyze_file(const std::string& path, const AnalyzeOptions& options);
/// The same of what was read. Its settings are not looked at.
AnalyzedFile analyze_system(SystemDescription system, const AnalyzeOptions& options);

/// Why a chain is not guaranteed, after its name: "may take 12.000 ms, its deadline is 10.000 ms".
std::string why_not_guaranteed(const SystemModel::Chain& chain, const ModelBounds::Chain& bound);
/// What the bounds of these callbacks' executors rest on: "declared 5, measured 2".
std::string rests_on(const AnalyzedFile& file, const std::vector<std::size_t>& callbacks);

/// Call it before the system is analysed: two nodes of one name cannot be.
SimulatedChains simulate_chains(const SystemDescription& system, const AnalyzeOptions& options);

nlohmann::json analysis_json(const AnalyzedFile& file);
/// In short: each chain's bound, deadline and verdict.
nlohmann::json bounds_json(const AnalyzedFile& file);
void print_analysis(const AnalyzedFile& file);
/// How the bound of a chain comes about. Throws Error if there is no such chain.
void print_explanation(const AnalyzedFile& file, const std::string& chain);

/// A change that makes the worst chain better.
struct Suggestion {
  std::string change;
  std::string chain;                         // the one that gains most
  std::optional<Nanoseconds> before, after;  // its bound
};
/// The best first.
struct Suggestions {
  std::vector<Suggestion> found;
  std::size_t tried = 0;
  bool is_complete = true;  // not ended by the limit of time
};
/// Tries other executors, schedulers, priorities and CPUs, one change at a time, and none that
/// would probably end later than `most` after the call.
Suggestions suggestions(const AnalyzedFile& file, Nanoseconds most);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_ANALYZED_FILE_HPP_
