// Which callbacks starve under overload?
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <thread>

#include <fmt/format.h>

#include "takt/executors/executor.hpp"
#include "takt/rt_tests/rt_test.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

constexpr int kTimers = 6;
constexpr Nanoseconds kPeriod = 2ms, kWork = 500us;  // 150 % of a CPU
constexpr int kReleases = 150;

/// The share of releases that each timer served, in percent; the last timer is the most urgent.
std::vector<double> shares(const std::string& scheduler) {
  const auto executor =
      executors().make("events", {.scheduler = scheduler, .threads = {rt::realtime_thread(50)}});
  const auto node = std::make_shared<Node>("node");
  std::vector<int> runs(kTimers);
  std::vector<std::shared_ptr<Timer>> timers;
  for (int i = 0; i < kTimers; ++i) {
    const auto group = node->create_callback_group(fmt::format("group_{}", i),
                                                   CallbackGroupType::MutuallyExclusive);
    group->set_parameters({.priority = i});
    timers.push_back(node->create_timer(
        fmt::format("timer_{}", i), kPeriod,
        [&runs, i] {
          ++runs[i];
          rt::burn(kWork);
        },
        group));
  }
  const auto end = node->create_timer("end", kPeriod * kReleases, [&] { executor->cancel(); });
  const auto urgent = end->group();
  urgent->set_parameters({.priority = 100});
  executor->add_node(node);
  std::thread([&] { executor->spin(); }).join();
  std::vector<double> result;
  for (int i = 0; i < kTimers; ++i) {
    result.push_back(100.0 * runs[i] / kReleases);
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(
      argc, argv,
      "Which callbacks starve when timers need 150 % of a CPU? (share of the releases that each "
      "served, in %; prio5 is the most urgent)");
  test.needs_realtime();
  for (const std::string& name : schedulers().names()) {
    const std::vector<double> share = shares(name);
    std::vector<std::pair<std::string, double>> values;
    for (int i = 0; i < kTimers; ++i) values.emplace_back(fmt::format("prio{}_%", i), share[i]);
    test.add("events, " + name, values);
    const auto [least, most] = std::minmax_element(share.begin(), share.end());
    if (name == "fifo" || name == "round_robin") {
      test.expect(*least >= *most / 3,
                  fmt::format("{}: the smallest share is at least a third of the "
                              "largest ({:.0f} % and {:.0f} %)",
                              name, *least, *most));
    } else if (name == "fixed_priority") {
      test.expect(share.back() > 70, fmt::format("{}: the most urgent timer serves most of its "
                                                 "releases ({:.0f} %)",
                                                 name, share.back()));
      test.expect(share.front() < 20, fmt::format("{}: the least urgent timer starves ({:.0f} %)",
                                                  name, share.front()));
    }
  }
  return test.finish();
}
