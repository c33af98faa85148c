// takt bench: repeats the experiments of the paper "Impact of ROS 2 Node Composition in Robotic
// Systems", each with one command.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <numeric>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "takt/base/time.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/measuring/run.hpp"

#include "bench/claims.hpp"
#include "bench/experiments.hpp"
#include "bench/measure.hpp"
#include "commands.hpp"
#include "embedded.hpp"
#include "exit_status.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "report.hpp"
#include "run/live_line.hpp"
#include "run/result_json.hpp"
#include "run/run_again.hpp"
#include "run/verdicts.hpp"
#include "table.hpp"

namespace takt::tools::bench_command {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// What is counted is added up: a median would hide the one run that lost messages.
bool is_count(const std::string& metric) {
  return metric == "received" || metric == "lost" || metric == "hot_path_drops" ||
         metric == "hot_path_samples";
}

/// A metric over all runs.
json over_runs(const std::string& metric, const std::vector<double>& values) {
  if (is_count(metric)) {
    return {{"sum", std::accumulate(values.begin(), values.end(), 0.0)}, {"runs", values}};
  }
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return {{"median", rt::median(values)}, {"min", *least}, {"max", *most}, {"runs", values}};
}

/// Progress through all runs of all experiments.
struct Course {
  const EndSignals& signals;
  std::size_t done = 0, total = 0;
  std::optional<Interrupted> interrupted;  // why it stopped early, if so
  LiveLine line{"measuring"};
};

/// The measurements of one variant in all its runs.
struct Measured {
  std::map<std::string, std::vector<double>> values;  // by metric
  std::size_t runs = 0;
  Histogram latency;
};

/// Runs the variants in turn for each repeat, until all are done or a signal arrives.
std::vector<Measured> run_all(const Experiment& experiment, const std::vector<Variant>& variants,
                              const BenchOptions& options, Course& course) {
  std::vector<Measured> measured(variants.size());
  const Nanoseconds asked = parse_run_time(options.duration);
  try {
    for (int repeat = 0; repeat < options.repeat; ++repeat) {
      for (std::size_t i = 0; i < variants.size(); ++i) {
        const Variant& variant = variants[i];
        if (!variant.missing.empty()) continue;
        const std::string x = experiment.x_label.empty() ? "" : fmt::format(" {}", variant.x);
        course.line.step(fmt::format("{}, {}{}", experiment.name, variant.series, x), course.done,
                         course.total, asked);
        const Figures figures = measure(variant, options, repeat, course.signals);
        for (const auto& [metric, value] : figures.values) {
          measured[i].values[metric].push_back(value);
        }
        measured[i].latency.merge(figures.latency);
        ++measured[i].runs;
        ++course.done;
      }
    }
  } catch (const Interrupted& interruption) {
    course.interrupted.emplace(interruption.signal, fmt::format(" when {} of {} runs were complete",
                                                                course.done, course.total));
  }
  course.line.hide();
  return measured;
}

/// The ratio of a metric to that of another variant, in the runs that both have; nullopt: without
/// the metric in each run, or if one was 0.
std::optional<rt::Ratio> ratio_of(const std::string& metric, const Measured& of,
                                  const Measured& to) {
  const auto values_of = [&metric](const Measured& measured) {
    const auto found = measured.values.find(metric);
    const bool is_whole = found != measured.values.end() && found->second.size() == measured.runs;
    return is_whole ? found->second : std::vector<double>();
  };
  std::vector<double> values = values_of(of), others = values_of(to);
  const std::size_t pairs = std::min(values.size(), others.size());
  values.resize(pairs);
  others.resize(pairs);
  const auto is_positive = [](double value) { return value > 0; };
  if (pairs < 2 || !std::all_of(values.begin(), values.end(), is_positive) ||
      !std::all_of(others.begin(), others.end(), is_positive)) {
    return std::nullopt;
  }
  return rt::ratio_of_pairs(values, others);
}

/// Two files of the user are two systems.
bool are_comparable(const Variant& one, const Variant& other) {
  const auto is_file = [](const Variant& variant) {
    return !variant.system.empty() && variant.system.find('\n') == std::string::npos;
  };
  return one.x == other.x && (one.system == other.system || !is_file(one) || !is_file(other));
}

/// Each metric of each variant to that of the first series that is comparable.
std::vector<Compared> ratios_of(const Experiment& experiment, const std::vector<Variant>& variants,
                                const std::vector<Measured>& measured, double seconds) {
  std::vector<Compared> all;
  if (!experiment.claims.empty()) return all;  // these say what is compared with what
  for (std::size_t i = 0; i < variants.size(); ++i) {
    std::size_t first = 0;
    while (first < i &&
           (measured[first].runs == 0 || !are_comparable(variants[first], variants[i]))) {
      ++first;
    }
    if (first == i) continue;
    const std::string at = experiment.x_label.empty() ? "" : fmt::format(" at {}", variants[i].x);
    for (const std::string& metric : experiment.metrics) {
      if (is_count(metric)) continue;
      const auto ratio = ratio_of(metric, measured[i], measured[first]);
      if (!ratio) continue;
      all.push_back({.row = {experiment.name, variants[i].series + at},
                     .other = variants[first].series,
                     .figure = metric,
                     .ratio = *ratio,
                     .seconds = seconds,
                     .other_seconds = seconds,
                     .samples = measured[i].latency.count()});
    }
  }
  decide(all);
  return all;
}

json ratios_json_of(std::span<const Compared> all) {
  json ratios = json::array();
  for (const Compared& each : all) {
    json ratio = ratio_json(each);
    ratio["series"] = each.row.executor;
    ratios.push_back(std::move(ratio));
  }
  return ratios;
}

/// All metrics with their spread.
std::pair<json, std::vector<Compared>> run(const Experiment& experiment,
                                           const BenchOptions& options, Course& course) {
  const std::vector<Variant> variants = experiment.variants(options);
  const std::vector<Measured> measured = run_all(experiment, variants, options, course);
  json rows = json::array();
  for (std::size_t i = 0; i < variants.size(); ++i) {
    json row{{"series", variants[i].series}};
    if (measured[i].values.empty()) row["missing"] = "interrupted before its first run";
    if (!variants[i].missing.empty()) row["missing"] = variants[i].missing;
    if (row.contains("missing")) {
      rows.push_back(std::move(row));
      continue;
    }
    if (!experiment.x_label.empty()) row["x"] = variants[i].x;
    for (const auto& [metric, of_runs] : measured[i].values) {
      row["metrics"][metric] = over_runs(metric, of_runs);
    }
    json buckets = json::array();
    measured[i].latency.for_each_bucket([&](std::size_t, Nanoseconds limit, std::uint64_t count) {
      buckets.push_back({rt::us(limit), count});
    });
    row["latency_buckets_us"] = std::move(buckets);
    rows.push_back(std::move(row));
  }
  std::vector<std::string> deviations = experiment.deviations;
  if (experiment.is_of_paper) {
    deviations.push_back(
        fmt::format("Medians of {} run(s); the paper shows means of 10.", options.repeat));
  }
  json named = json::object();
  for (const std::string& metric : experiment.metrics) named[metric] = labels().at(metric);
  std::vector<Compared> ratios =
      ratios_of(experiment, variants, measured, rt::us(parse_run_time(options.duration)) / 1e6);
  json result = {{"name", experiment.name},
                 {"title", experiment.title},
                 {"x_label", experiment.x_label},
                 {"metrics", experiment.metrics},
                 {"duration", options.duration},
                 {"repeat", options.repeat},
                 {"statistics", "full"},
                 {"labels", named},
                 {"deviations", deviations},
                 {"rows", std::move(rows)},
                 {"ratios", ratios_json_of(ratios)}};
  if (!experiment.claims.empty()) {
    const auto values_of = [&](const Variant& variant, const std::string& metric) {
      const auto& values = measured[static_cast<std::size_t>(&variant - variants.data())].values;
      const auto found = values.find(metric);
      return found != values.end() ? found->second : std::vector<double>();
    };
    result["claims"] = try_claims(experiment, variants, values_of);
  }
  return {std::move(result), std::move(ratios)};
}

void print(const json& experiment) {
  std::vector<std::string> header{"series"};
  const bool has_x = !experiment.at("x_label").get<std::string>().empty();
  if (has_x) header.push_back(experiment.at("x_label"));
  for (const json& metric : experiment.at("metrics")) {
    header.push_back(metric);
    header.push_back("spread");
  }
  header.emplace_back("received");
  header.emplace_back("lost");
  Table table(header);
  for (const json& row : experiment.at("rows")) {
    std::vector<std::string> cells{row.at("series")};
    if (row.contains("missing")) {
      cells.push_back(row.at("missing"));
      cells.resize(header.size());
      table.add(std::move(cells));
      continue;
    }
    const auto number = [](double value) {
      return fmt::format("{:.{}f}", value, value < 10 ? 2 : value < 1000 ? 1 : 0);
    };
    if (has_x) cells.push_back(fmt::format("{}", row.at("x").get<double>()));
    for (const json& metric : experiment.at("metrics")) {
      const json& metrics = row.at("metrics");
      if (!metrics.contains(metric.get<std::string>())) {
        cells.insert(cells.end(), 2, "-");
        continue;
      }
      const json& value = metrics.at(metric.get<std::string>());
      if (value.contains("sum")) {
        cells.push_back(fmt::format("{:.0f}", value.at("sum").get<double>()));
        cells.push_back("sum");
      } else {
        cells.push_back(number(value.at("median")));
        cells.push_back(number(value.at("min")) + "–" + number(value.at("max")));
      }
    }
    for (const char* metric : {"received", "lost"}) {
      cells.push_back(fmt::format("{:.0f}", row.at("metrics").at(metric).at("sum").get<double>()));
    }
    table.add(std::move(cells));
  }
  std::string deviations;
  for (const json& deviation : experiment.at("deviations")) {
    deviations += "\n  " + deviation.get<std::string>();
  }
  table.print(fmt::format(
      "{}: {} (medians of {} run(s) of {}, interleaved; counts: sums; latency: mean, publish → "
      "callback; statistics full){}",
      experiment.at("name").get<std::string>(), experiment.at("title").get<std::string>(),
      experiment.at("repeat").get<int>(), experiment.at("duration").get<std::string>(),
      deviations.empty() ? "" : "\nNot as in the original:" + deviations));
}

void write(const json& document, const BenchOptions& options) {
  if (!options.json.empty()) write_json(document, options.json);
  if (options.report.empty()) return;
  write_json(document, fs::path(options.report) / "results.json");
  write_report(document, fs::path(options.report) / "report.html");
}

/// Those that are there: the folder may be new.
std::vector<std::string> files_of_report(const std::string& folder) {
  std::error_code none;
  if (!fs::is_directory(folder, none)) return {};
  return {fs::path(folder) / "results.json", fs::path(folder) / "report.html"};
}

bool is_meant(const Experiment& experiment, const BenchOptions& options) {
  if (options.name == "literature") return !experiment.claims.empty();
  if (options.name != "all") return experiment.name == options.name;
  return experiment.claims.empty() && (experiment.name != "topologies" || !options.files.empty());
}

void bench(const BenchOptions& options) {
  if (!options.files.empty() && options.name != "topologies" && options.name != "all") {
    throw UsageError(fmt::format("'{}' takes no FILE", options.name), "leave it out");
  }
  use_own_domain();
  const fs::path folder = options.report;
  if (!options.report.empty()) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed)
      throw Error(fmt::format("--report: the folder {} cannot be made: {}", options.report,
                              failed.message()),
                  "name another folder");
    if (!fs::is_directory(folder))
      throw Error(fmt::format("--report: {} is no folder", options.report), "name another one");
    check_report(folder / "report.html");
  }
  std::vector<const Experiment*> chosen;
  for (const Experiment& experiment : experiments()) {
    if (is_meant(experiment, options)) chosen.push_back(&experiment);
  }
  begin_work();
  EndSignals signals;
  Course course{.signals = signals};
  for (const Experiment* experiment : chosen) {
    for (const Variant& variant : experiment->variants(options)) {
      if (variant.missing.empty()) course.total += static_cast<std::size_t>(options.repeat);
    }
  }
  json document = rt::result_document({});
  document["paper"] = rt::parse_json(kPaperFigures);
  document["experiments"] = json::array();
  for (const Experiment* experiment : chosen) {
    auto [result, ratios] = run(*experiment, options, course);
    if (options.json != "-" && course.done != 0) {
      print(result);
      if (result.contains("claims")) print_claims(result.at("claims"));
      const bool can_have_ratios =
          experiment->claims.empty() && (!ratios.empty() || options.repeat == 1);
      if (can_have_ratios && check_repeats(ratios)) print_sentences(ratios);
    }
    document["experiments"].push_back(std::move(result));
    if (course.interrupted) break;
  }
  if (options.name == "all" && !options.report.empty() && !course.interrupted) {
    try {
      document["jitter"] = jitter(options, signals);
      document["timeline"] = timeline(signals);
    } catch (const Interrupted& interruption) {
      course.interrupted.emplace(interruption.signal,
                                 " after the last run, before jitter and timeline");
    }
  }
  signals.end();
  if (course.done != 0 || !course.interrupted) write(document, options);
  if (course.interrupted) throw Interrupted(*course.interrupted);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<BenchOptions>();
  std::vector<std::string> names{"all", "literature"};
  for (const Experiment& experiment : experiments()) names.push_back(experiment.name);
  one_of(command->add_option("NAME", options->name, fmt::format("{}", fmt::join(names, ", ")))
             ->required(),
         names);
  command->add_option("FILE", options->files, "Systems to run, for 'topologies' only");
  time_text(
      command->add_option("--duration", options->duration, "Duration of each run (default: 2s)"));
  whole_number(
      command->add_option("--repeat", options->repeat, "Runs of each variant (default: 10)"), 1,
      1000);
  add_output(*command, "--report", options->report,
             "Write report.html and results.json into this folder", files_of_report);
  add_output(*command, "--json", options->json, "Also write the results as JSON; - for stdout");
  command->footer("Example:\n  takt bench latency --repeat 5 --report bench_report\n");
  command->callback([options] { bench(*options); });
}
const Command registered(
    "bench", "Repeats the experiments of the paper on node composition, and of papers on executors",
    set_up);

}  // namespace
}  // namespace takt::tools::bench_command
