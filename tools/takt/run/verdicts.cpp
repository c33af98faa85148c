// SPDX-License-Identifier: Apache-2.0
#include "run/verdicts.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "run/decisive_figures.hpp"
#include "run/setup.hpp"
#include "table.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::string_view kStored = ".compared.json";

/// All runs of one row.
struct RowRuns {
  RowName name;
  Setup setup;
  std::map<std::size_t, std::vector<Figure>> repeats;
  std::vector<double> seconds;
};

std::vector<RowRuns> rows_of(const std::vector<rt::Run>& runs) {
  std::vector<RowRuns> rows;
  for (const rt::Run& run : runs) {
    RowName name{run.file, run.executor, run.placement, run.scheduler, run.composition};
    auto row = std::find_if(rows.begin(), rows.end(),
                            [&name](const RowRuns& other) { return other.name == name; });
    if (row == rows.end()) row = rows.insert(row, {std::move(name), setup_of(run), {}, {}});
    row->repeats[run.repeat] = decisive_figures(run);
    row->seconds.push_back(run.duration_s);
  }
  return rows;
}

bool is_called(const RowName& row, const std::string& name) {
  return row.text() == name || row.executor == name;
}

/// The row of `rows` that `name` is compared with, among those for which `is_it`; nullptr: none.
template <class IsIt>
const RowRuns* find_row(const std::vector<RowRuns>& rows, const RowName& name, const IsIt& is_it) {
  const RowRuns* found = nullptr;
  for (const RowRuns& row : rows) {
    if (!is_it(row.name)) continue;
    if (row.name.file == name.file) return &row;
    if (found == nullptr) found = &row;
  }
  return found;
}

/// What was stored of this row. One row alone stands for all; files are often renamed.
const RowRuns* stored_row(const std::vector<RowRuns>& stored, const RowName& name) {
  if (stored.size() == 1) return &stored.front();
  return find_row(stored, name, [&name](const RowName& row) { return row.text() == name.text(); });
}

std::vector<std::string> names_of(std::span<const RowName> rows) {
  std::vector<std::string> names;
  for (const RowName& row : rows) {
    if (std::find(names.begin(), names.end(), row.text()) == names.end()) {
      names.push_back(row.text());
    }
  }
  return names;
}

/// The names that were stored in this folder.
std::vector<std::string> stored_names() {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(".", ignored)) {
    const std::string file = entry.path().filename();
    if (file.ends_with(kStored)) {
      names.push_back(printable(file.substr(0, file.size() - kStored.size())));
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<rt::Run> read_stored(const std::string& path) {
  // Limit: bytes of a file of stored runs. At it: an error. Seen: the error.
  constexpr std::size_t kMostStoredBytes = 1 << 30;
  std::vector<rt::Run> runs =
      rt::read_runs(rt::json_or_null(read_text(path, kMostStoredBytes)), path + ": ");
  if (runs.empty()) throw Error("no runs are stored in it", "store them again", path);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].duration_s > 0) continue;
    throw Error(
        fmt::format("runs[{}].duration_s is {}, and must be above 0", i, runs[i].duration_s),
        "store the runs again", path);
  }
  return runs;
}

/// The values of a figure in each repeat that has a ratio.
std::map<std::size_t, Figure> values_of(const RowRuns& row, const std::string& name) {
  std::map<std::size_t, Figure> values;
  for (const auto& [repeat, figures] : row.repeats) {
    for (const Figure& figure : figures) {
      if (figure.name == name && figure.value > 0) values[repeat] = figure;
    }
  }
  return values;
}

bool is_count(const std::map<std::size_t, Figure>& values) {
  return !values.empty() && values.begin()->second.is_count;
}

/// Then the half count more of each run weighs more in the shorter ones.
bool differ_in_length(double seconds, double other_seconds) {
  return std::abs(seconds - other_seconds) > 0.1 * other_seconds;
}

bool is_all_zero(const std::map<std::size_t, Figure>& values) {
  return std::all_of(values.begin(), values.end(),
                     [](const auto& value) { return value.second.is_zero; });
}

std::optional<rt::Ratio> ratio_of(const std::map<std::size_t, Figure>& values,
                                  const std::map<std::size_t, Figure>& others, bool is_paired) {
  if (is_all_zero(values) && is_all_zero(others)) return std::nullopt;
  std::vector<double> of, to;
  for (const auto& [repeat, figure] : values) {
    if (!is_paired || others.contains(repeat)) of.push_back(figure.value);
  }
  for (const auto& [repeat, figure] : others) {
    if (!is_paired || values.contains(repeat)) to.push_back(figure.value);
  }
  if (of.size() < 2 || to.size() < 2) return std::nullopt;
  return is_paired ? rt::ratio_of_pairs(of, to) : rt::ratio_of_groups(of, to);
}

std::vector<std::string> figures_of(const RowRuns& row) {
  std::vector<std::string> names;
  for (const auto& [repeat, figures] : row.repeats) {
    for (const Figure& figure : figures) {
      if (std::find(names.begin(), names.end(), figure.name) == names.end()) {
        names.push_back(figure.name);
      }
    }
  }
  return names;
}

/// Those of `names` that are not among `others`, as a list.
std::string those_without(const std::vector<std::string>& names,
                          const std::vector<std::string>& others) {
  std::vector<std::string> left;
  for (const std::string& name : names) {
    if (std::find(others.begin(), others.end(), name) == others.end()) left.push_back(name);
  }
  return fmt::format("{}", fmt::join(left, ", "));
}

void compare_with(std::vector<Compared>& all, const RowRuns& row, const RowRuns& other,
                  const std::string& other_name, bool is_paired) {
  const double seconds = rt::median(row.seconds), other_seconds = rt::median(other.seconds);
  for (const std::string& name : figures_of(row)) {
    const std::map<std::size_t, Figure> values = values_of(row, name);
    if (is_count(values) && differ_in_length(seconds, other_seconds)) continue;
    const std::optional<rt::Ratio> ratio = ratio_of(values, values_of(other, name), is_paired);
    if (!ratio) continue;
    Compared compared{.row = row.name,
                      .other = other_name,
                      .figure = name,
                      .besides = difference(row.setup, other.setup),
                      .ratio = *ratio,
                      .seconds = seconds,
                      .other_seconds = other_seconds};
    for (const auto& [repeat, figure] : values) {
      if (figure.samples) compared.samples = compared.samples.value_or(0) + *figure.samples;
    }
    all.push_back(std::move(compared));
  }
}

/// Calls `visit` with each part whose rows have the same key.
template <class Of, class Visit>
void for_each_part(std::span<const Compared> all, const Of& of, const Visit& visit) {
  while (!all.empty()) {
    const auto end = std::find_if(
        all.begin(), all.end(), [&](const Compared& each) { return of(each) != of(all.front()); });
    const auto count = static_cast<std::size_t>(end - all.begin());
    visit(all.first(count));
    all = all.subspan(count);
  }
}

/// With as many decimals as the interval lets matter.
std::string number(double value, const rt::Ratio& ratio) {
  const double width = std::max(ratio.high - ratio.low, 1e-4);
  const int decimals = static_cast<int>(std::clamp(-std::floor(std::log10(width)), 0.0, 4.0));
  return fmt::format("{:.{}f}", value, std::max(decimals, ratio.value < 10 ? 2 : 0));
}

std::string interval(const Compared& compared) {
  const rt::Ratio& ratio = compared.ratio;
  return fmt::format("{} ({} to {})", number(ratio.value, ratio), number(ratio.low, ratio),
                     number(ratio.high, ratio));
}

/// The repeats of the side that has fewer.
std::size_t of_both(const rt::Ratio& ratio) {
  return ratio.other_repeats == 0 ? ratio.repeats : std::min(ratio.repeats, ratio.other_repeats);
}

bool is_limit_stored(const rt::Ratio& ratio) {
  return ratio.other_repeats != 0 && ratio.other_repeats <= ratio.repeats;
}

std::string too_few(std::size_t repeats) {
  return fmt::format(
      "no verdict: {} cannot tell a difference from chance; six are the least, --repeat 10 tells "
      "more\n",
      counted(repeats, "repeat"));
}

std::string too_few_stored(std::size_t repeats) {
  return fmt::format(
      "no verdict: {} cannot tell a difference from chance; six are the least: store them again "
      "with --repeat 10\n",
      counted(repeats, "stored repeat"));
}

void print_file(std::span<const Compared> of_file, bool is_paired) {
  Table table(
      {"executor", "of", "figure", "ratio", "from", "to", "verdict", "repeats", "seconds", "n"});
  for (const Compared& each : of_file) {
    const rt::Ratio& ratio = each.ratio;
    table.add(
        {each.row.text(), each.other, each.figure, number(ratio.value, ratio),
         number(ratio.low, ratio), number(ratio.high, ratio), rt::text_of(ratio, each.decision),
         is_paired ? std::to_string(ratio.repeats)
                   : fmt::format("{} and {}", ratio.repeats, ratio.other_repeats),
         fmt::format("{:.2f}", each.seconds), each.samples ? std::to_string(*each.samples) : "-"});
  }
  table.print(fmt::format("{} (ratios, 95 % intervals{})", of_file.front().row.file,
                          is_paired ? ", pairs of runs that took turns" : ""));
  rt::print("\n");
  print_sentences(of_file);
}

}  // namespace

std::string RowName::text() const {
  std::string text = executor;
  if (placement != "file" && placement != "as") text += " " + placement;
  if (scheduler != "file") text += " " + scheduler;
  if (composition != "file") text += " " + composition;
  return text;
}

std::string stored_path(const std::string& name) {
  return name.ends_with(".json") ? name : name + std::string(kStored);
}

Against find_against(const std::string& name, std::span<const RowName> rows) {
  const bool is_row = std::any_of(rows.begin(), rows.end(),
                                  [&name](const RowName& row) { return is_called(row, name); });
  if (name.empty() || is_row) return {name, {}};
  const std::string path = stored_path(name);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    std::vector<std::string> valid = names_of(rows);
    for (std::string& stored : stored_names()) valid.push_back(std::move(stored));
    throw Error(fmt::format("--against: '{}' is neither a row of this comparison nor stored as {}",
                            printable(name), printable(path)),
                suggest(name, valid));
  }
  Against against{name, read_stored(path)};
  const std::vector<RowRuns> stored = rows_of(*against.stored);
  std::vector<RowName> stored_names;
  for (const RowRuns& row : stored) stored_names.push_back(row.name);
  for (const RowName& row : rows) {
    if (stored_row(stored, row) != nullptr) continue;
    const RowName merged{row.file, row.executor, "merged", row.scheduler, row.composition};
    throw Error(fmt::format("nothing is stored of '{}'", row.text()),
                stored_row(stored, merged) != nullptr
                    ? "compare with --placement merged, or store it again"
                    : suggest(row.text(), names_of(stored_names)),
                path);
  }
  return against;
}

std::vector<Compared> compare_rows(const std::vector<rt::Run>& runs, const Against& against) {
  const std::vector<RowRuns> rows = rows_of(runs);
  const bool is_paired = !against.stored;
  const std::vector<RowRuns> stored = is_paired ? std::vector<RowRuns>() : rows_of(*against.stored);
  std::vector<Compared> all;
  std::size_t decided = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const RowName& name = rows[i].name;
    const RowRuns* other =
        is_paired ? find_row(rows, name,
                             [&](const RowName& row) {
                               return row.file == name.file &&
                                      (against.name.empty() || is_called(row, against.name));
                             })
                  : stored_row(stored, name);
    if (other != nullptr && other != &rows[i]) {
      const std::string other_name =
          is_paired ? other->name.text() : fmt::format("{} ({})", other->name.text(), against.name);
      compare_with(all, rows[i], *other, other_name, is_paired);
    }
    if (i + 1 == rows.size() || rows[i + 1].name.file != name.file) {
      decide(std::span(all).subspan(decided));
      decided = all.size();
    }
  }
  return all;
}

void decide(std::span<Compared> family) {
  std::vector<rt::Ratio> ratios;
  for (const Compared& each : family) ratios.push_back(each.ratio);
  const std::vector<rt::Decision> decisions = rt::decide(ratios);
  for (std::size_t i = 0; i < family.size(); ++i) family[i].decision = decisions[i];
}

json ratio_json(const Compared& compared) {
  const rt::Ratio& ratio = compared.ratio;
  const rt::Decision& decision = compared.decision;
  const bool is_paired = ratio.other_repeats == 0;
  return {{"against", compared.other},
          {"is_paired", is_paired},
          {"figure", compared.figure},
          {"ratio", ratio.value},
          {"low", ratio.low},
          {"high", ratio.high},
          {"p", ratio.p},
          {"repeats", ratio.repeats},
          {"against_repeats", is_paired ? ratio.repeats : ratio.other_repeats},
          {"duration_s", compared.seconds},
          {"against_duration_s", compared.other_seconds},
          {"samples", compared.samples ? json(*compared.samples) : json()},
          {"verdict", rt::word_of(decision.verdict)},
          {"repeats_to_decide", decision.repeats ? json(*decision.repeats) : json()}};
}

json ratios_json(std::span<const Compared> all) {
  json ratios = json::array();
  for (const Compared& each : all) {
    json ratio = ratio_json(each);
    ratio["file"] = each.row.file;
    ratio["executor"] = each.row.executor;
    ratio["placement"] = each.row.placement;
    ratio["scheduler"] = each.row.scheduler;
    ratio["composition"] = each.row.composition;
    ratios.push_back(std::move(ratio));
  }
  return ratios;
}

std::string sentence(std::span<const Compared> row) {
  std::string real, same, open, none;
  const std::string& besides = row.front().besides;
  const auto add = [](std::string& list, const std::string& text) {
    list += (list.empty() ? "" : ", ") + text;
  };
  for (const Compared& each : row) {
    const std::optional<std::size_t> repeats = each.decision.repeats;
    switch (each.decision.verdict) {
      case rt::Verdict::real:
        add(real, fmt::format("{}{} {}", each.figure, real.empty() ? " is" : "", interval(each)) +
                      (real.empty() ? " of " + each.other : ""));
        break;
      case rt::Verdict::same:
        add(same, fmt::format("{} within {:.1f} %", each.figure, rt::same_percent(each.ratio)));
        break;
      case rt::Verdict::open:
        add(open, each.figure + (repeats ? fmt::format(" ({} repeats would decide)", *repeats)
                                         : std::string(" (1000 would not)")));
        break;
      case rt::Verdict::none:
        add(none, fmt::format("{} ({} of 6 {}repeats)", each.figure, of_both(each.ratio),
                              is_limit_stored(each.ratio) ? "stored " : ""));
    }
  }
  const auto part = [](const char* name, const std::string& list) {
    return list.empty() ? "" : fmt::format(" {}: {}.", name, list);
  };
  return fmt::format("{}: {}.{}{}{}", row.front().row.text(),
                     real.empty()
                         ? "no real difference from " + row.front().other
                         : real + ": real" + (besides.empty() ? "" : ", and so differ " + besides),
                     part("The same", same), part("Open", open), part("No verdict", none));
}

void print_sentences(std::span<const Compared> all) {
  for_each_part(
      all, [](const Compared& each) { return each.row; },
      [](std::span<const Compared> row) { rt::print("{}\n", sentence(row)); });
}

bool check_repeats(std::span<const Compared> all) {
  std::size_t repeats = 1;
  bool are_stored = false;  // then more of the others would not help
  for (const Compared& each : all) {
    if (each.decision.verdict != rt::Verdict::none) return true;
    if (of_both(each.ratio) < repeats) continue;
    repeats = of_both(each.ratio);
    are_stored = is_limit_stored(each.ratio);
  }
  rt::print("{}", are_stored ? too_few_stored(repeats) : too_few(repeats));
  return false;
}

std::string lengths_note(std::span<const Compared> all) {
  for (const Compared& each : all) {
    if (!differ_in_length(each.seconds, each.other_seconds)) continue;
    return fmt::format(
        "runs of {} took {:.2f} s, of {} {:.2f} s: the longer a run, the larger its maximum; "
        "counts (misses, wakeups/s) are left out\n",
        each.other, each.other_seconds, each.row.text(), each.seconds);
  }
  return "";
}

std::vector<std::string> stored_notes(const std::vector<rt::Run>& runs, const Against& against) {
  if (!against.stored) return {};
  const std::vector<RowRuns> stored = rows_of(*against.stored);
  std::vector<std::string> notes;
  const auto add = [&notes](std::string note) {
    if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
  };
  for (const RowRuns& row : rows_of(runs)) {
    const RowRuns* const other = stored_row(stored, row.name);
    if (other == nullptr) continue;
    if (fs::path(other->name.file).lexically_normal() !=
        fs::path(row.name.file).lexically_normal()) {
      add(fmt::format("{} was stored of {}, and is compared with {}", against.name,
                      other->name.file, row.name.file));
    }
    const std::vector<std::string> now = figures_of(row), then = figures_of(*other);
    if (const std::string gone = those_without(then, now); !gone.empty()) {
      add(fmt::format("{}: {} has figures that these runs lack: {}", row.name.text(), against.name,
                      gone));
    }
    if (const std::string added = those_without(now, then); !added.empty()) {
      add(fmt::format("{}: {} lacks figures of these runs: {}", row.name.text(), against.name,
                      added));
    }
  }
  return notes;
}

void print_verdicts(std::span<const Compared> all, const Against& against) {
  if (all.empty() && against.stored) {  // one repeat has no ratio
    std::size_t least = rt::kLeastRepeats;
    for (const RowRuns& row : rows_of(*against.stored)) least = std::min(least, row.repeats.size());
    if (least < rt::kLeastRepeats) {
      rt::print("{}", too_few_stored(least));
      return;
    }
  }
  if (!check_repeats(all)) return;
  const bool is_paired = !against.stored;
  for_each_part(
      all, [](const Compared& each) { return each.row.file; },
      [is_paired](std::span<const Compared> of_file) { print_file(of_file, is_paired); });
  if (!is_paired) {
    rt::print(
        "{} was stored: its runs and these did not take turns, so how the machine changed in "
        "between is in these ratios\n",
        against.name);
  }
  rt::print("{}", lengths_note(all));
}

}  // namespace takt::tools
