// SPDX-License-Identifier: Apache-2.0
#include "run/result_csv.hpp"

#include <initializer_list>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "takt/base/histogram.hpp"
#include "takt/base/printable.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/rounds.hpp"

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
  /// What follows is of this run, or of this ratio.
  void begin(const json& of) {
    first_.clear();
    for (const char* key : {"file", "executor", "placement", "scheduler", "composition"}) {
      first_ += cell(of.at(key)) + ",";
    }
    first_ += cell(of.value("repeat", json())) + "," + cell(of.at("duration_s"));
  }
  /// And of this callback, thread, …
  void of(const std::string& what, const json& process, const std::string& name) {
    second_ = fmt::format("{},{},{}", what, cell(process), quoted(name));
  }
  void add(const std::string& figure, const json& samples, const json& value,
           const std::string& from = "", const std::string& to = "",
           const std::string& verdict = "") {
    if (value.is_null()) return;
    text_ += fmt::format("{},{},{},{},{},{},{},{}\n", first_, second_, quoted(figure),
                         cell(samples), from, to, cell(value), verdict);
  }
  std::string take() { return std::move(text_); }

 private:
  std::string first_, second_;
  std::string text_ =
      "file,executor,placement,scheduler,composition,repeat,seconds,of,process,name,figure,n,from,"
      "to,value,"
      "verdict\n";
};

/// `name`: "latency_us".
void add_times(CsvLines& lines, const json& of, const std::string& name) {
  const json& times = of.at(name);
  const json& samples = times.at("count");
  for (const char* key : {"mean", "min", "p50", "p90", "p99", "p999", "max"}) {
    lines.add(fmt::format("{} {}", name, key), samples, times.at(key));
  }
  for (const json& bucket : times.value("histogram", json::array())) {
    const auto index = bucket.at(0).get<std::size_t>();
    const auto limit = [](std::size_t number) {
      return fmt::format("{}", rt::us(Histogram::upper_limit(number)));
    };
    lines.add(name + " bucket", samples, bucket.at(1), index == 0 ? "0" : limit(index - 1),
              limit(index));
  }
}

void add_counts(CsvLines& lines, const json& of, const json& samples,
                std::initializer_list<const char*> keys) {
  for (const char* key : keys) lines.add(key, samples, of.at(key));
}

void add_run(CsvLines& lines, const json& run) {
  lines.begin(run);
  for (const json& callback : run.at("callbacks")) {
    lines.of(
        callback.at("kind"), callback.at("process"),
        callback.at("node").get<std::string>() + "/" + callback.at("callback").get<std::string>());
    add_counts(lines, callback, callback.at("received"),
               {"received", "lost", "dropped", "overruns", "skipped", "late", "too_late",
                "deadline_misses"});
    for (const char* times : {"latency_us", "waiting_us", "take_us", "execution_us"}) {
      add_times(lines, callback, times);
    }
  }
  for (const json& chain : run.at("chains")) {
    lines.of("chain", chain.at("process"), chain.at("name"));
    add_counts(lines, chain, chain.at("instances"), {"instances", "misses", "aborted"});
    add_times(lines, chain, "latency_us");
  }
  for (const json& thread : run.at("threads")) {
    lines.of("thread", thread.at("process"), thread.at("name"));
    add_counts(lines, thread, {}, {"cpu_percent", "spin_percent", "wakeups"});
  }
  for (const json& process : run.at("processes")) {
    lines.of("process", process.at("name"), process.at("name"));
    add_counts(lines, process, {},
               {"cpu_percent", "pss_kb", "allocations_while_spinning", "allocations_in_dds"});
  }
}

}  // namespace

std::string result_csv(const json& document) {
  CsvLines lines;
  for (const json& run : document.at("runs")) add_run(lines, run);
  for (const json& ratio : document.value("ratios", json::array())) {
    lines.begin(ratio);
    lines.of("ratio", {}, ratio.at("against"));
    lines.add(ratio.at("figure"), ratio.at("repeats"), ratio.at("ratio"), cell(ratio.at("low")),
              cell(ratio.at("high")), ratio.at("verdict"));
  }
  return lines.take();
}

}  // namespace takt::tools
