// Compares rows of runs: ratios with intervals, and which differences are real.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_VERDICTS_HPP_
#define TAKT_TOOLS_TAKT_VERDICTS_HPP_

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/measuring/ratio.hpp"
#include "takt/measuring/run.hpp"

namespace takt::tools {

/// What tells one row of a comparison from another.
struct RowName {
  std::string file, executor, placement = "file", scheduler = "file", composition = "file";
  bool operator==(const RowName&) const = default;
  /// Without the file: "events", "events merged edf per-node".
  std::string text() const;
};

/// What the rows are compared with: the row of this name, else the runs that were stored by it,
/// else the first row of each file.
struct Against {
  std::string name;
  std::optional<std::vector<rt::Run>> stored;
};

/// Finds what `--against` names, for these rows. Throws Error if there is no such thing, or if what
/// is stored lacks one of the rows.
Against find_against(const std::string& name, std::span<const RowName> rows);

/// The file of `--save NAME`: NAME.compared.json, or NAME itself if it ends with .json.
std::string stored_path(const std::string& name);

/// One figure of a row, and how many times as large it is as that of another.
struct Compared {
  RowName row;
  std::string other, figure;
  std::string besides = {};  // difference() of their setups
  rt::Ratio ratio;
  rt::Decision decision;
  double seconds = 0, other_seconds = 0;  // of one run, the medians
  std::optional<std::uint64_t> samples;   // of all its runs
};

/// Of all rows of the runs but those that the others are compared with. The decisions are for each
/// file together. Without two repeats a figure has no ratio, and is not there; nor
/// has a count if the runs differ in length by more than 10 %.
std::vector<Compared> compare_rows(const std::vector<rt::Run>& runs, const Against& against);

/// Decides on all of them as one family.
void decide(std::span<Compared> family);

/// As an entry of "ratios" in results, without the names of the row.
nlohmann::json ratio_json(const Compared& compared);
/// All entries.
nlohmann::json ratios_json(std::span<const Compared> all);

/// "events: p99 is 0.81 (0.78 to 0.84) of single_threaded: real. …", of one row.
std::string sentence(std::span<const Compared> row);
/// Of each row a line.
void print_sentences(std::span<const Compared> all);
/// The same for a page: [{"file", "text"}].
nlohmann::json sentences_json(std::span<const Compared> all);

/// Whether any has a verdict. Else it says in a line that the repeats are too few; there was one if
/// there are no ratios.
bool check_repeats(std::span<const Compared> all);

/// A line if runs that are compared differ in length, else nothing.
std::string lengths_note(std::span<const Compared> all);

/// What tells the stored runs from these: another file, figures that only one side has. Nothing if
/// none are stored.
std::vector<std::string> stored_notes(const std::vector<rt::Run>& runs, const Against& against);

/// A table and a sentence for each row, of one file after the other; one line if all have too few
/// repeats.
void print_verdicts(std::span<const Compared> all, const Against& against);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_VERDICTS_HPP_
