// SPDX-License-Identifier: Apache-2.0
#include "latency/output.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/utsname.h>

#include "takt/base/output_file.hpp"
#include "takt/base/version.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

std::string command_line() {
  std::ifstream file("/proc/self/cmdline");
  std::string line;
  for (std::string word; std::getline(file, word, '\0');) {
    if (!line.empty()) line += ' ';
    line += word;
  }
  return line;
}

std::int64_t in_unit(Nanoseconds duration, const rt::CyclicOptions& cyclic) {
  return duration / cyclic.bin;
}

std::string each(const Rows& rows, const std::function<std::string(const rt::CyclicResult&)>& get) {
  std::string line;
  for (const auto& row : rows) (line += ' ') += get(row->result());
  return line;
}

json thread_json(const rt::CyclicVariant& row, const rt::CyclicOptions& cyclic) {
  const rt::CyclicResult& result = row.result();
  const ThreadAttributes& asked = row.options().thread;
  json histogram = json::object();
  for (std::size_t bin = 0; bin < result.bins.size(); ++bin) {
    if (result.bins[bin] != 0) histogram[std::to_string(bin)] = result.bins[bin];
  }
  const bool empty = result.cycles == 0;
  return {{"histogram", std::move(histogram)},
          {"cycles", result.cycles},
          {"min", empty ? 0 : in_unit(result.min, cyclic)},
          {"max", empty ? 0 : in_unit(result.max, cyclic)},
          {"avg", empty ? 0
                        : static_cast<double>(result.mean().count()) /
                              static_cast<double>(cyclic.bin.count())},
          {"cpu", result.in_force.affinity.empty() ? 0 : result.in_force.affinity.front()},
          {"node", 0},
          {"name", result.name},
          {"p50_us", result.rounds.p50()},
          {"p99_us", result.rounds.p99()},
          {"p999_us", rt::us(result.rounds.all.percentile(0.999))},
          {"round_p50_us", result.rounds.p50_us},
          {"round_p99_us", result.rounds.p99_us},
          {"over_time", result.over_time ? rt::over_time_json(*result.over_time) : json()},
          {"overflows", result.overflows},
          {"early", result.early},
          {"missed", result.missed},
          {"cpu_percent", result.cpu_percent()},
          {"page_faults", result.counters.minor_faults + result.counters.major_faults},
          {"asked",
           {{"policy", std::string(to_string(asked.policy))},
            {"priority", asked.priority},
            {"affinity", asked.affinity}}},
          {"in_force",
           {{"policy", std::string(to_string(result.in_force.policy))},
            {"priority", result.in_force.priority},
            {"affinity", result.in_force.affinity},
            {"refused", result.in_force.refused}}}};
}

std::string utc(std::time_t value) {
  std::tm parts{};
  gmtime_r(&value, &parts);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S +0000", &parts);
  return text.data();
}

}  // namespace

/// cyclictest's summary, one line per thread. Takt's rows alternate in time; each is one line.
void print_summary(const Rows& rows, const rt::CyclicOptions& cyclic, std::FILE* file) {
  int number = 0;
  for (const auto& row : rows) {
    const rt::CyclicResult& result = row->result();
    const bool empty = result.cycles == 0;
    fmt::print(file, "T:{:2} ({:5}) P:{:2} I:{} C:{:7} Min:{:7} Act:{:5} Avg:{:5} Max:{:8}\n",
               number++, result.in_force.tid, result.in_force.priority,
               row->options().interval / 1us, result.cycles,
               empty ? 0 : in_unit(result.min, cyclic), in_unit(result.last, cyclic),
               in_unit(result.mean(), cyclic), empty ? 0 : in_unit(result.max, cyclic));
  }
}

/// cyclictest's histogram: one line per µs, one column per row, and one for all of them.
std::string histogram_text(const Rows& rows, const rt::CyclicOptions& cyclic, bool with_sum) {
  std::string text;
  const auto to = std::back_inserter(text);
  fmt::format_to(to, "# Histogram\n");
  for (std::size_t bin = 0; bin < cyclic.bins; ++bin) {
    std::uint64_t sum = 0;
    fmt::format_to(to, "{:06}", bin);
    for (const auto& row : rows) {
      fmt::format_to(to, " {:06}", row->result().bins[bin]);
      sum += row->result().bins[bin];
    }
    fmt::format_to(to, "{}\n", with_sum ? fmt::format(" {:06}", sum) : "");
  }
  std::uint64_t total = 0, overflows = 0;  // what is in the bins, and what is above
  Nanoseconds max{0};
  for (const auto& row : rows) {
    total += row->result().cycles - row->result().overflows;
    overflows += row->result().overflows;
    max = std::max(max, row->result().max);
  }
  const auto line = [&](const char* name, const std::string& sum, const auto& get) {
    fmt::format_to(to, "# {}:{}{}\n", name, each(rows, get),
                   with_sum && !sum.empty() ? " " + sum : "");
  };
  line("Total", fmt::format("{:09}", total),
       [](const auto& result) { return fmt::format("{:09}", result.cycles - result.overflows); });
  line("Min Latencies", "", [&](const auto& result) {
    return fmt::format("{:05}", in_unit(result.cycles == 0 ? 0ns : result.min, cyclic));
  });
  line("Avg Latencies", "",
       [&](const auto& result) { return fmt::format("{:05}", in_unit(result.mean(), cyclic)); });
  line("Max Latencies", fmt::format("{:05}", in_unit(max, cyclic)), [&](const auto& result) {
    return fmt::format("{:05}", in_unit(result.cycles == 0 ? 0ns : result.max, cyclic));
  });
  line("Histogram Overflows", fmt::format("{:05}", overflows),
       [](const auto& result) { return fmt::format("{:05}", result.overflows); });
  fmt::format_to(to, "# Histogram Overflow at cycle number:\n");
  int number = 0;
  for (const auto& row : rows) {
    fmt::format_to(to, "# Thread {}: {}\n", number++,
                   fmt::join(row->result().overflow_cycles, " "));
  }
  return text;
}

void print_values(const Rows& rows, std::size_t first, std::size_t count) {
  for (std::size_t row = first; row < first + count; ++row) {
    const std::vector<Nanoseconds>& values = rows[row]->values();
    std::uint64_t cycle = rows[row]->result().cycles - values.size();
    for (const Nanoseconds value : values) {
      rt::print("{:8}:{:8}:{:8}\n", row, cycle++, in_unit(value, rows[row]->options()));
    }
  }
}

/// Results that cyclictest does not have. Scripts for its output skip lines that begin with '#'.
void print_details(const Rows& rows, const rt::CyclicOptions& cyclic, const Outcome& outcome) {
  rt::print("#\n# {:<3} {:<39} {:>8} {:>8} {:>8} {:>8} {:>8} {:>6} {:>6} {:>7} {:>6}  {}\n", "T",
            "in µs", "p50", "p99", "p99.9", "p50/T0", "p99/T0", "early", "missed", "cpu_%",
            "faults", "in force");
  for (std::size_t number = 0; number < rows.size(); ++number) {
    const rt::CyclicResult& result = rows[number]->result();
    const rt::CyclicResult& bare = rows[number % outcome.threads]->result();  // of this thread
    const auto ratio = [](double value, double of_bare) {
      return of_bare == 0 ? 0 : value / of_bare;
    };
    rt::print(
        "# {:<3} {:<39} {:>8.2f} {:>8.2f} {:>8.2f} {:>8.2f} {:>8.2f} {:>6} {:>6} {:>7.2f} {:>6}  "
        "{}\n",
        number, result.name, result.rounds.p50(), result.rounds.p99(),
        rt::us(result.rounds.all.percentile(0.999)), ratio(result.rounds.p50(), bare.rounds.p50()),
        ratio(result.rounds.p99(), bare.rounds.p99()), result.early, result.missed,
        result.cpu_percent(), result.counters.minor_faults + result.counters.major_faults,
        fmt::format("{} {} on {}", to_string(result.in_force.policy), result.in_force.priority,
                    fmt::join(result.in_force.affinity, ",")));
  }
  rt::print("# p50, p99: medians of {} rounds, in which the rows alternate\n",
            rows.front()->result().rounds.p50_us.size());
  rt::print("# {}\n", rt::machine_line());
  rt::print(
      "# a thread that only read the clock missed {} spans over {} µs in {:.1f} s: longest "
      "{:.0f} µs, {:.2f} % of the time\n",
      outcome.gaps.count, rt::Gaps::kThreshold / 1us, rt::us(outcome.gaps.observed) / 1e6,
      rt::us(outcome.gaps.longest),
      outcome.gaps.observed == 0ns
          ? 0.0
          : 100 * rt::us(outcome.gaps.total) / rt::us(outcome.gaps.observed));
  rt::print("# stolen by the host: {:.2f} %\n", outcome.observation.steal_percent);
  for (const rt::Neighbour& neighbour : outcome.observation.neighbours) {
    rt::print("# another real-time thread ran for {:.1f} ms: {} ({}, {} {}) on {}\n",
              rt::us(neighbour.cpu_time) / 1e3, neighbour.name, neighbour.thread, neighbour.policy,
              neighbour.priority, fmt::join(neighbour.affinity, ","));
  }
  for (const std::string& note : outcome.notes) rt::print("# {}\n", note);
  if (cyclic.break_above != 0ns) {
    for (const auto& row : rows) {
      if (row->result().broke) {
        rt::print("# Break thread: {}\n# Break value: {}\n", row->result().in_force.tid,
                  in_unit(row->result().max, cyclic));
      }
    }
  }
}

/// The JSON format of rt-tests 2.4, with additional keys.
json to_json(const Rows& rows, const rt::CyclicOptions& cyclic, const Outcome& outcome) {
  utsname name{};
  uname(&name);
  json threads = json::object();
  int number = 0;
  for (const auto& row : rows) {
    threads[std::to_string(number++)] = thread_json(*row, cyclic);
  }
  return {{"file_version", 1},
          {"cmdline:", command_line()},
          {"rt_test_version:", fmt::format("takt {}", TAKT_VERSION)},
          {"start_time", utc(outcome.start)},
          {"end_time", utc(outcome.end)},
          {"return_code", outcome.return_code},
          {"sysinfo",
           {{"sysname", name.sysname},
            {"nodename", name.nodename},
            {"release", name.release},
            {"version", name.version},
            {"machine", name.machine},
            {"realtime", rt::preemption_model() == "PREEMPT_RT" ? 1 : 0}}},
          {"num_threads", rows.size()},
          {"resolution_in_ns", cyclic.bin == 1ns ? 1 : 0},  // as cyclictest: 0 for µs
          {"thread", std::move(threads)},
          {"load", outcome.load},
          {"machine", rt::machine_json()},
          {"disturbance", rt::to_json(outcome.observation)},
          {"gaps",
           {{"threshold_us", rt::us(rt::Gaps::kThreshold)},
            {"count", outcome.gaps.count},
            {"longest_us", rt::us(outcome.gaps.longest)},
            {"total_us", rt::us(outcome.gaps.total)},
            {"observed_us", rt::us(outcome.gaps.observed)}}},
          {"notes", outcome.notes}};
}

}  // namespace takt::tools
