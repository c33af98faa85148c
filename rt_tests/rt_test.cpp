// SPDX-License-Identifier: Apache-2.0
#include "takt/rt_tests/rt_test.hpp"

#include <algorithm>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/output.hpp"

namespace takt::rt {
namespace {

constexpr int kBadUsage = 2, kSkipped = 77;

void check_output(const std::string& path) {
  try {
    OutputFile::check(path);
  } catch (const Error& error) {
    to_stderr("{}\n", error.what());
    std::exit(kBadUsage);
  }
}

}  // namespace

RtTest::RtTest(int argc, char** argv, std::string question) : question_(std::move(question)) {
  guard_output();
  if (const char* rounds = std::getenv("TAKT_ROUNDS")) rounds_ = std::max(0, std::atoi(rounds));
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--json" && i + 1 < argc) {
      json_ = argv[++i];
      check_output(json_);
    } else if (word == "--rounds" && i + 1 < argc && std::atoi(argv[i + 1]) > 0) {
      rounds_ = std::atoi(argv[++i]);
    } else {
      if (word == "--help") print_help(argv[0]);
      to_stderr("{}: unknown option '{}', or its value is missing; see {} --help\n", argv[0], word,
                argv[0]);
      std::exit(kBadUsage);
    }
  }
}

// In the form of the help of `takt`, of which pages for man are made.
void RtTest::print_help(std::string_view program) const {
  fmt::print(
      "{}\n"
      "Usage: {} [OPTIONS]\n\n"
      "Options:\n"
      "  --help                      Print this help message and exit\n"
      "  --rounds N                  Rounds, in which the rows of the table take turns\n"
      "                              (default: TAKT_ROUNDS, else what the question needs)\n"
      "  --json FILE                 Also write table, expectations and machine as JSON\n\n"
      "Exit status: 0 if all expectations hold, 1 if one does not, 2 for wrong words,\n"
      "77 if the machine denies the rights that the question needs.\n",
      question_, program.substr(program.rfind('/') + 1));
  std::exit(checked_output(0));
}

void RtTest::needs_realtime() {
  std::string refused;
  std::thread([&] { refused = apply(realtime_thread(80), Realtime::prefer).refused; }).join();
  if (!refused.empty()) skip(refused);
}

void RtTest::skip(const std::string& reason) {
  fmt::print("skipped: {}\n", reason);
  std::exit(checked_output(kSkipped));
}

void RtTest::add(const std::string& row,
                 const std::vector<std::pair<std::string, double>>& values) {
  rows_.push_back({row, values});
}

void RtTest::expect(bool holds, const std::string& relation) {
  expectations_.emplace_back(holds, relation);
}

void RtTest::expect_at_most(double limit, const std::vector<double>& values,
                            const std::vector<double>& to, const std::string& relation) {
  const Interval ratio = paired_ratio(values, to);
  expect(ratio.low <= limit, fmt::format("{}: {:.3g} times, 95 % interval {:.3g} to {:.3g}",
                                         relation, ratio.median, ratio.low, ratio.high));
}

int RtTest::finish() {
  try {
    return checked_output(report());
  } catch (const std::exception& error) {  // of fmt::print
    to_stderr("{}\n", error.what());
    return 1;
  }
}

int RtTest::report() {
  fmt::print("{}\n\n", question_);
  std::size_t width = 0;
  for (const Row& row : rows_) width = std::max(width, row.name.size());
  if (!rows_.empty()) {
    fmt::print("{:<{}}", "", width);
    for (const auto& [column, value] : rows_.front().values) fmt::print("  {:>12}", column);
    fmt::print("\n");
  }
  nlohmann::json rows = nlohmann::json::array(), expectations = nlohmann::json::array();
  for (const Row& row : rows_) {
    fmt::print("{:<{}}", row.name, width);
    nlohmann::json object{{"row", row.name}};
    for (const auto& [column, value] : row.values) {
      fmt::print("  {:>12}", value == static_cast<double>(static_cast<std::int64_t>(value))
                                 ? fmt::format("{:.0f}", value)
                                 : fmt::format("{:.2f}", value));
      object[column] = value;
    }
    fmt::print("\n");
    rows.push_back(std::move(object));
  }
  fmt::print("\n");
  bool all_hold = true;
  for (const auto& [holds, relation] : expectations_) {
    fmt::print("{}  {}\n", holds ? "holds " : "FAILED", relation);
    expectations.push_back({{"holds", holds}, {"relation", relation}});
    all_hold = all_hold && holds;
  }
  fmt::print("\n{}\n", machine_line());
  if (!json_.empty()) {
    const nlohmann::json document{{"question", question_},
                                  {"machine", machine_json()},
                                  {"rows", std::move(rows)},
                                  {"expectations", std::move(expectations)}};
    write_output(json_, std::string(kTaktsJson) + document.dump(2) + "\n");
  }
  return all_hold ? 0 : 1;
}

ThreadAttributes realtime_thread(int priority, const std::string& name) {
  return {.name = name,
          .policy = ThreadPolicy::fifo,
          .priority = priority,
          .affinity = {available_cpus().back()}};
}

void burn(Nanoseconds cpu_time) noexcept {
  const Nanoseconds until = thread_cpu_time() + cpu_time;
  while (thread_cpu_time() < until) {
  }
}

}  // namespace takt::rt
