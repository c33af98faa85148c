// SPDX-License-Identifier: Apache-2.0
#include "run/comparison_tables.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "takt/base/histogram.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"

#include "commands.hpp"
#include "table.hpp"

namespace takt::tools {
namespace {

/// The cells that identify a row.
class Names {
 public:
  explicit Names(std::span<const Comparison> rows)
      : has_schedulers_(std::any_of(rows.begin(), rows.end(),
                                    [](const auto& row) { return !row.scheduler.empty(); })),
        has_compositions_(std::any_of(rows.begin(), rows.end(),
                                      [](const auto& row) { return row.composition != "file"; })) {}

  std::vector<std::string> header(const std::vector<std::string>& rest) const {
    return cells("executor", "scheduler", "composition", rest);
  }
  std::vector<std::string> row(const Comparison& row, const std::vector<std::string>& rest) const {
    return cells(row.executor, row.scheduler, row.composition, rest);
  }

 private:
  std::vector<std::string> cells(const std::string& executor, const std::string& scheduler,
                                 const std::string& composition,
                                 const std::vector<std::string>& rest) const {
    std::vector<std::string> cells{executor};
    if (has_schedulers_) cells.push_back(scheduler);
    if (has_compositions_) cells.push_back(composition);
    cells.insert(cells.end(), rest.begin(), rest.end());
    return cells;
  }
  const bool has_schedulers_, has_compositions_;
};

std::string other_names(const Comparison& row) {
  std::string text;
  if (row.placement != "file" && row.placement != "as") text += " " + row.placement;
  if (!row.scheduler.empty()) text += " " + row.scheduler;
  if (row.composition != "file") text += " " + row.composition;
  return text;
}

/// Of a histogram with a full bucket, percentiles are marked.
std::string percentile(const Histogram& latency, double fraction) {
  if (latency.count() == 0) return "-";
  return tools::microseconds(latency.percentile(fraction)) + (latency.is_saturated() ? "~" : "");
}

std::vector<std::string> percentiles(const Histogram& latency) {
  std::vector<std::string> cells;
  for (const double fraction : {0.5, 0.9, 0.99, 0.999, 1.0}) {
    cells.push_back(percentile(latency, fraction));
  }
  return cells;
}

/// Counts of runs of different lengths can only be compared by the second.
std::string per_second(std::uint64_t count, const Comparison& row) {
  return row.seconds == 0 ? "-" : fmt::format("{:.1f}", static_cast<double>(count) / row.seconds);
}

std::vector<std::string> cells_of(const Comparison& row) {
  std::vector<std::string> cells{
      row.setup.threads_text(), fmt::format("{:.2f}{}", row.seconds, row.is_long ? "!" : ""),
      std::to_string(row.totals.messages.received), per_second(row.totals.messages.received, row)};
  for (const std::optional<std::uint64_t> count :
       {std::optional(row.totals.lost), std::optional(row.totals.messages.dropped),
        std::optional(row.totals.overruns), row.totals.messages.late, row.totals.messages.too_late,
        std::optional(row.totals.messages.deadline_misses)}) {
    cells.push_back(count ? std::to_string(*count) : "-");
  }
  for (std::string& cell : percentiles(row.totals.latency)) cells.push_back(std::move(cell));
  cells.push_back(percentile(row.totals.timer_latency, 0.99));
  const double pss_mb = rt::median(row.pss_mb);  // a simulation has no process
  cells.push_back(pss_mb == 0 ? "-" : fmt::format("{:.2f}", rt::median(row.cpu_percent)));
  cells.push_back(fmt::format("{:.0f}", rt::median(row.wakeups_per_s)));
  cells.push_back(pss_mb == 0 ? "-" : fmt::format("{:.1f}", pss_mb));
  return cells;
}

/// An executor that skips releases looks good otherwise: what never ran was never late.
std::string served_text(std::span<const Comparison> rows) {
  std::string text;
  for (const Comparison& row : rows) {
    if (row.releases.due == 0) continue;
    // Rounded down: 100 % are all.
    const std::uint64_t tenths = row.releases.served * 1000 / row.releases.due;
    text += fmt::format("{}{}{} {}.{} % ({} of {})", text.empty() ? "" : ", ", row.executor,
                        other_names(row), tenths / 10, tenths % 10, row.releases.served,
                        row.releases.due);
  }
  return text.empty() ? "" : fmt::format("releases of timers that were served: {}\n", text);
}

/// What else than its word a row differs in.
void print_differences(std::span<const Comparison> rows) {
  std::vector<std::pair<std::string, Setup>> setups;
  for (const Comparison& row : rows)
    setups.emplace_back(row.executor + other_names(row), row.setup);
  for (const std::string& line : differences(setups)) rt::print("rows differ in {}\n", line);
}

/// Rows of one file.
void print(std::span<const Comparison> rows, const std::string& runs) {
  const std::string title = with_program(rows.front().file);
  const Names names(rows);
  Table table(names.header({"threads", "seconds", "received", "received/s", "lost", "dropped",
                            "overruns", "late", "too_late", "misses", "p50", "p90", "p99", "p99.9",
                            "max", "timer_p99", "cpu_%", "wakeups/s", "pss_MB"}));
  // Sort by chain, so that compared rows are next to each other.
  std::map<std::string, std::vector<std::vector<std::string>>> by_chain;
  for (const Comparison& row : rows) {
    table.add(names.row(row, cells_of(row)));
    for (const auto& [name, chain] : row.totals.chains) {
      std::vector<std::string> cells{name,
                                     fmt::format("{:.2f}", row.seconds),
                                     std::to_string(chain.instances),
                                     per_second(chain.instances, row),
                                     std::to_string(chain.misses),
                                     std::to_string(chain.aborted)};
      for (std::string& cell : percentiles(chain.latency)) cells.push_back(std::move(cell));
      by_chain[name].push_back(names.row(row, cells));
    }
  }
  print_differences(rows);
  table.print(
      fmt::format("{} ({}; latency of subscriptions in µs, publish → callback)", title, runs));
  rt::print("{}", served_text(rows));
  if (std::any_of(rows.begin(), rows.end(), [](const auto& row) { return row.is_long; })) {
    rt::print("! a run took longer than asked: compare its counts by the second\n");
  }
  Table chains(names.header({"chain", "seconds", "instances", "instances/s", "misses", "aborted",
                             "p50", "p90", "p99", "p99.9", "max"}));
  for (auto& [name, chain_rows] : by_chain) {
    for (auto& row : chain_rows) chains.add(std::move(row));
  }
  chains.print(fmt::format("{} ({}; chains, release of the first callback → end of the last, µs)",
                           title, runs));
}

/// "20 runs each", or after an interruption how many there were: "3 to 4 of 20 runs each".
std::string runs_text(std::span<const Comparison> rows, int repeats) {
  const auto [least, most] =
      std::minmax_element(rows.begin(), rows.end(), [](const auto& row, const auto& other) {
        return row.cpu_percent.size() < other.cpu_percent.size();
      });
  const std::size_t from = least->cpu_percent.size(), to = most->cpu_percent.size();
  std::string complete;
  if (from != to) complete = fmt::format("{} to {} of ", from, to);
  if (from == to && std::cmp_less(to, repeats)) complete = fmt::format("{} of ", to);
  return fmt::format("{}{} run{} each, ", complete, repeats, repeats == 1 ? "" : "s");
}

}  // namespace

void print_comparison(std::span<const Comparison> rows, int repeats, bool is_simulated) {
  const std::string runs = runs_text(rows, repeats) + (is_simulated ? "simulated" : "interleaved");
  while (!rows.empty()) {
    const auto end = std::find_if(rows.begin(), rows.end(),
                                  [&](const auto& row) { return row.file != rows.front().file; });
    const auto count = static_cast<std::size_t>(end - rows.begin());
    print(rows.first(count), runs);
    rows = rows.subspan(count);
  }
}

}  // namespace takt::tools
