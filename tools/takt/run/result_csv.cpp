// SPDX-License-Identifier: Apache-2.0
#include "run/result_csv.hpp"

#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "takt/base/histogram.hpp"
#include "takt/base/printable.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/measuring/row_json.hpp"
#include "takt/measuring/run_fields.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

/// Names of topics and files may hold commas and quotes, and begin as formulas of a spreadsheet do.
std::string quoted(const std::string& text) {
  const bool is_formula =
      !text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos;
  const std::string shown = (is_formula ? "'" : "") + printable(text);
  if (shown.find_first_of(",\"") == std::string::npos) return shown;
  std::string result = "\"";
  for (const char character : shown) {
    if (character == '"') result += '"';
    result += character;
  }
  return result + '"';
}

/// An empty cell for what was not measured.
std::string cell(const json& value) {
  if (value.is_null()) return "";
  return value.is_string() ? quoted(value.get<std::string>()) : rt::json_text(value);
}

class CsvLines {
 public:
  explicit CsvLines(bool with_buckets) : with_buckets_(with_buckets) {}

  /// What follows is of this run, or of this ratio.
  template <class Row>
  void begin(const Row& row, const json& repeat, double seconds) {
    first_.clear();
    for (const std::string& name :
         {row.file, row.executor, row.placement, row.scheduler, row.composition}) {
      first_ += quoted(name) + ",";
    }
    first_ += cell(repeat) + "," + cell(seconds);
  }
  /// And of this callback, thread, …
  void of(std::string_view what, const std::string& process, const std::string& name) {
    second_ = fmt::format("{},{},{}", what, quoted(process), quoted(name));
  }
  void add(const std::string& figure, const json& samples, const json& value,
           const std::string& from = "", const std::string& to = "",
           const std::string& verdict = "") {
    if (value.is_null()) return;
    text_ += fmt::format("{},{},{},{},{},{},{},{}\n", first_, second_, quoted(figure),
                         cell(samples), from, to, cell(value), verdict);
  }
  /// All figures of a row, which rest on so many samples.
  template <class Row>
  void add_row(const Row& row, const json& samples) {
    const auto add_field = [&]<class Value>(const auto& field, const Value& value) {
      if constexpr (std::is_same_v<Value, Histogram>) {
        add_times(field.name, rt::row_json(value, with_buckets_));
      } else if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, Nanoseconds> ||
                           std::is_same_v<Value, std::optional<std::uint64_t>>) {
        add(field.name, samples, rt::row_json(value));
      }
    };
    for_each_field(add_field, row);
  }
  std::string take() { return std::move(text_); }

 private:
  void add_times(const std::string& name, const json& times) {
    const json& samples = times.at("count");
    for (const char* key : {"mean", "min", "p50", "p90", "p99", "p999", "max"}) {
      add(fmt::format("{} {}", name, key), samples, times.at(key));
    }
    for (const json& bucket : times.value("histogram", json::array())) {
      const auto index = bucket.at(0).get<std::size_t>();
      const auto limit = [](std::size_t number) {
        return fmt::format("{}", rt::us(Histogram::upper_limit(number)));
      };
      add(name + " bucket", samples, bucket.at(1), index == 0 ? "0" : limit(index - 1),
          limit(index));
    }
  }

  const bool with_buckets_;
  std::string first_, second_;
  std::string text_ =
      "file,executor,placement,scheduler,composition,repeat,seconds,of,process,name,figure,n,from,"
      "to,value,"
      "verdict\n";
};

void add_run(CsvLines& lines, const rt::Run& run) {
  lines.begin(run, run.repeat, run.duration_s);
  for (const rt::Run::Callback& callback : run.callbacks) {
    const CallbackStatistics& of = callback.statistics;
    lines.of(to_string(of.kind), callback.process, of.node + "/" + of.callback);
    lines.add_row(callback, of.received);
  }
  for (const rt::Run::Chain& chain : run.chains) {
    lines.of("chain", chain.process, chain.name);
    lines.add_row(chain, chain.statistics.instances);
  }
  for (const rt::Run::Thread& thread : run.threads) {
    lines.of("thread", thread.process, thread.name);
    lines.add_row(thread, {});
  }
  for (const rt::Run::Process& process : run.processes) {
    lines.of("process", process.name, process.name);
    lines.add_row(process, {});
  }
}

}  // namespace

std::string result_csv(const std::vector<rt::Run>& runs, bool with_buckets,
                       std::span<const Compared> ratios) {
  CsvLines lines(with_buckets);
  for (const rt::Run& run : runs) add_run(lines, run);
  for (const Compared& each : ratios) {
    lines.begin(each.row, {}, each.seconds);
    lines.of("ratio", "", each.other);
    lines.add(each.figure, each.ratio.repeats, each.ratio.value, cell(each.ratio.low),
              cell(each.ratio.high), std::string(rt::word_of(each.decision.verdict)));
  }
  return lines.take();
}

}  // namespace takt::tools
