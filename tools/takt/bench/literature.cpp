// SPDX-License-Identifier: Apache-2.0
#include "bench/literature.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "takt/containers/component.hpp"

#include "embedded.hpp"

namespace takt::tools {
namespace {

/// A series: a system, and the word of the catalogue that it runs as. "": as it is.
struct Side {
  std::string series, system, as;
  double x = 0;
};

/// Each side under the real kernel and on two virtual CPUs.
std::vector<Variant> variants_of(const std::vector<Side>& sides) {
  std::vector<Variant> variants;
  for (const bool is_simulated : {false, true}) {
    for (const Side& side : sides) {
      Variant& variant = variants.emplace_back(Variant{
          .series = side.series, .x = side.x, .system = side.system, .is_simulated = is_simulated});
      if (!side.as.empty()) variant.words = {"--as", side.as};
      if (!is_simulated) continue;
      variant.series += kSimulated;
      variant.words = joined(variant.words, {"--cpus", "2"});
    }
  }
  return variants;
}

/// `paper`: the word of the catalogue; `before`: what the paper compared it with.
auto both(const std::string& system, const std::string& before, const std::string& paper) {
  return [=](const BenchOptions&) {
    return variants_of({{before, system, before}, {paper, system, paper}});
  };
}

std::string threads(int count) {
  return fmt::format(
      "threads: {{t: {{policy: SCHED_FIFO, priority: 50}}}}\n"
      "executors: {{default: {{type: events, threads: [{}]}}}}\n",
      count == 1 ? "t" : "t, t");
}

/// `more`: further keys of the component.
std::string node(const std::string& name, const std::string& parameters,
                 const std::string& more = "") {
  return fmt::format("    - {{component: takt::Workload, name: {}, parameters: {{{}}}{}{}}}\n",
                     name, parameters, more.empty() ? "" : ", ", more);
}

std::string container(const std::vector<std::string>& nodes) {
  std::string text = "container:\n  name: bench\n  components:\n";
  for (const std::string& each : nodes) text += each;
  return text;
}

std::string publishes(const std::string& topic, int period_us, int work_us) {
  return fmt::format("publishers: {{topic: [{}], period_us: [{}], work_us: [{}]}}", topic,
                     period_us, work_us);
}
std::string relays(const std::string& input, const std::string& output, int work_us) {
  return fmt::format("relays: {{input: [{}], output: [{}], work_us: [{}]}}", input, output,
                     work_us);
}
std::string receives(const std::string& topic, int work_us) {
  return fmt::format("subscriptions: {{topic: [{}], work_us: [{}]}}", topic, work_us);
}

/// Two graphs on one thread: one is urgent, and the other takes long.
std::string two_graphs() {
  return threads(1) +
         "chains:\n"
         "  - {name: brake, priority: 2, deadline: 10ms, path: [imu/imu_timer, filter/imu, "
         "control/pose]}\n"
         "  - {name: avoid, priority: 1, deadline: 18ms, path: [camera/image_timer, detect/image, "
         "plan/objects]}\n" +
         container({node("camera", publishes("image", 40'000, 500)),
                    node("detect", relays("image", "objects", 7000)),
                    node("plan", receives("objects", 4000)),
                    node("imu", publishes("imu", 10'000, 500)),
                    node("filter", relays("imu", "pose", 2000)),
                    node("control", receives("pose", 1000))});
}

/// The same with priorities of callbacks, which a paper on these has instead of chains' ones.
std::string two_graphs_of_priorities() {
  std::string text = two_graphs();
  for (const auto& [callback, node_name, priority] :
       {std::tuple("imu_timer", "imu", 4), std::tuple("imu", "filter", 5),
        std::tuple("pose", "control", 6), std::tuple("image_timer", "camera", 1),
        std::tuple("image", "detect", 2), std::tuple("objects", "plan", 3)}) {
    const std::string name = fmt::format("name: {},", node_name);
    text.insert(text.find(name) + name.size(),
                fmt::format(" callbacks: {{{}: {{priority: {}}}}},", callback, priority));
  }
  return text;
}

/// Periods of WATERS 2015, 85 % of a CPU, half of it by one long task. `releases`: so many of each
/// timer may wait; 1: as rclcpp's timers, the others are missed.
std::string periodic_tasks(int releases) {
  std::vector<std::string> nodes;
  for (const auto& [period_ms, work_us] :
       {std::pair(5, 400), std::pair(10, 700), std::pair(20, 1500), std::pair(50, 2500),
        std::pair(100, 45'000)}) {
    nodes.push_back(
        node(fmt::format("task_{}", period_ms),
             publishes(fmt::format("t{}", period_ms), period_ms * 1000, work_us),
             fmt::format("callbacks: {{t{}_timer: {{releases: {}}}}}", period_ms, releases)));
  }
  return threads(1) + container(nodes);
}

/// The three examples of the artefact, a tenth as long: the timers of groups 1, 1, 2 and so on.
std::string starvation(int example) {
  const auto group = [](const char* name, const std::string& topics, const std::string& periods,
                        const std::string& works) {
    return node(name, fmt::format("publishers: {{topic: [{}], period_us: [{}], work_us: [{}]}}",
                                  topics, periods, works));
  };
  switch (example) {
    case 4:
      return threads(2) + container({group("one", "a, b", "100000, 100000", "100000, 50000"),
                                     group("two", "c", "100000", "50000")});
    case 5:
      return threads(2) +
             container({group("one", "a", "100000", "50000"), group("two", "b", "100000", "50000"),
                        group("three", "c, d", "100000, 100000", "50000, 100")});
    default:
      return threads(2) +
             container({group("one", "a", "100000", "33300"), group("two", "b", "100000", "33300"),
                        group("three", "c, d", "50000, 500000", "33400, 100")});
  }
}

/// A timer of 10 ms each.
std::string many_timers(int count) {
  std::vector<std::string> nodes;
  for (int i = 0; i < count; ++i)
    nodes.push_back(node(fmt::format("n{}", i), publishes(fmt::format("t{}", i), 10'000, 20)));
  return threads(2) + container(nodes);
}

/// A chain beside work that comes and goes on both CPUs, and is more urgent but for reservations.
/// `control`: what the chain's executor is.
std::string beside_work(const std::string& thread, const std::string& control) {
  const std::string mine = "executor: control";
  return fmt::format(
             "threads: {{control: {{{}}}, other: {{policy: SCHED_FIFO, priority: 50}}}}\n"
             "executors: {{control: {{threads: [control], {}}}, default: {{type: events, "
             "threads: [other, other]}}}}\n"
             "chains: [{{name: steer, path: [imu/imu_timer, filter/imu, control/pose]}}]\n",
             thread, control) +
         container({node("imu", publishes("imu", 20'000, 500), mine),
                    node("filter", relays("imu", "pose", 1000), mine),
                    node("control", receives("pose", 500), mine),
                    node("camera", publishes("image", 33'000, 12'000)),
                    node("lidar", publishes("scan", 47'000, 14'000)),
                    node("radar", publishes("echo", 29'000, 9000))});
}

/// Three kinds of requests at an accelerator that serves one after the other.
std::string accelerator(const std::string& scheduler) {
  return fmt::format(
             "threads: {{cpu: {{policy: SCHED_FIFO, priority: 60}}, accelerator: {{policy: "
             "SCHED_FIFO, priority: 50}}}}\n"
             "executors: {{default: {{type: events, threads: [cpu]}}, gpu: {{type: events, "
             "scheduler: {}, threads: [accelerator]}}}}\n"
             "chains:\n"
             "  - {{name: brake, priority: 2, path: [imu/imu_timer, gpu/imu, control/pose]}}\n"
             "  - {{name: map, priority: 1, path: [camera/image_timer, gpu/image, mapper/map]}}\n",
             scheduler) +
         container({node("camera", publishes("image", 30'000, 200)),
                    node("radar", publishes("echo", 30'000, 200)),
                    node("imu", publishes("imu", 30'000, 200)),
                    node("gpu",
                         "relays: {input: [image, echo, imu], output: [map, cloud, pose], "
                         "work_us: [6000, 6000, 1000]}",
                         "executor: gpu"),
                    node("control", receives("pose", 200)),
                    node("mapper", "subscriptions: {topic: [map, cloud], work_us: [200, 200]}")});
}

const std::string kWorkload =
    "The workload is ours, shaped after the paper's description; its times are assumed.";

Experiment on_three_chains(const std::string& paper, const std::string& title,
                           std::vector<Claim> claims) {
  return {.name = paper,
          .title = title,
          .x_label = "",
          .metrics = {"chain_p99_ms", "in_time_percent"},
          .variants = both(threads(2) + kThreeChains, "multi", paper),
          .deviations = {"Three chains of bench/workloads/three_chains.yaml, which need 90 % of "
                         "two CPUs; the paper's own have other times.",
                         "`multi` is Takt's multi_threaded, which starves nobody."},
          .is_of_paper = false,
          .claims = std::move(claims)};
}

std::vector<Variant> anytime(const BenchOptions&) {
  const auto& index = component_index();
  const bool is_here = std::any_of(index.begin(), index.end(),
                                   [](const auto& entry) { return entry.name == "demo::Planner"; });
  std::vector<Variant> variants;
  for (const auto& [series, cells] : {std::pair("whole", 20'000), std::pair("batches", 100)}) {
    variants.push_back(
        {.series = series,
         .system = threads(1) +
                   fmt::format("container:\n  name: bench\n  components:\n    - {{component: "
                               "demo::Planner, name: planner, parameters: {{cells_per_batch: "
                               "{}}}}}\n",
                               cells),
         .missing = is_here ? ""
                            : "its code is examples/21_batches: build it, and name its build with "
                              "TAKT_COMPONENT_PATH"});
  }
  return variants;
}

Experiment of_events_priority() {
  return {.name = "events_priority",
          .title = "Events by priority, every release a job (Teper et al., RTAS 2025)",
          .x_label = "",
          .metrics = {"served_percent", "p99_us"},
          .variants =
              [](const BenchOptions&) {
                return variants_of({{"single", periodic_tasks(1), "single"},
                                    {"events_ro", periodic_tasks(50), "events_ro"}});
              },
          .deviations = {"One set of tasks with periods of WATERS 2015, 85 % of a CPU; the "
                         "paper draws 1,000 sets, and compares bounds."},
          .is_of_paper = false,
          .claims = {{"Fewer jobs are dropped.", "served_percent", "single", "events_ro"}}};
}

Experiment of_edf_dag() {
  return {.name = "edf_dag",
          .title = "EDF of graphs (Bell et al., arXiv 2512.16926)",
          .x_label = "",
          .metrics = {"in_time_percent", "chain_p99_ms"},
          .variants = both(two_graphs(), "single", "dag_edf"),
          .deviations = {kWorkload},
          .is_of_paper = false,
          .claims = {{"More instances are in time than under the default executor.",
                      "in_time_percent", "single", "dag_edf"}}};
}

Experiment of_preemptive() {
  return {.name = "preemptive",
          .title = "Callbacks that interrupt each other (Liu et al., RTSS 2025)",
          .x_label = "",
          .metrics = {"chain_max_ms", "chain_p99_ms"},
          .variants = both(two_graphs_of_priorities(), "dag_fjp", "ros_rt"),
          .deviations = {kWorkload},
          .is_of_paper = false,
          .claims = {{"An urgent chain does not wait for long callbacks.", "chain_p99_ms", "ros_rt",
                      "dag_fjp"}}};
}

Experiment of_mt_fair() {
  return {.name = "mt_fair",
          .title = "Nobody starves in a pool (Teper et al., EMSOFT 2024)",
          .x_label = "example",
          .metrics = {"starved_timers", "served_percent"},
          .variants =
              [](const BenchOptions&) {
                std::vector<Side> sides;
                for (const int example : {4, 5, 6})
                  sides.push_back({"mt_fair", starvation(example), "mt_fair", example * 1.0});
                return variants_of(sides);
              },
          .deviations = {"All times are a tenth of the artefact's.",
                         "rclcpp, in which one timer of each example never runs, is not "
                         "here: no executor of Takt starves a timer."},
          .is_of_paper = false,
          .claims = {{"Every timer runs.", "starved_timers", "mt_fair", ""}}};
}

Experiment of_cie() {
  return {.name = "cie",
          .title = "A thread for each callback group (Ishikawa-Aso et al., RTAS 2025)",
          .x_label = "callbacks",
          .metrics = {"cpu_percent"},
          .variants =
              [](const BenchOptions&) {
                std::vector<Variant> variants;
                for (const int count : {2, 10, 50}) {
                  for (const char* const as : {"multi", "cie"}) {
                    variants.push_back({.series = as,
                                        .x = count * 1.0,
                                        .system = many_timers(count),
                                        .words = {"--as", as}});
                  }
                }
                return variants;
              },
          .deviations = {kWorkload, "`multi` is Takt's, which costs less than rclcpp's."},
          .is_of_paper = false,
          .claims = {{"It costs less than a pool, for any number of callbacks.", "cpu_percent",
                      "cie", "multi"}}};
}

Experiment of_let_servers() {
  return {
      .name = "let_servers",
      .title = "Logical execution time in a reservation (RTNS 2024)",
      .x_label = "",
      .metrics = {"chain_spread_ms", "chain_p99_ms"},
      .variants =
          [](const BenchOptions&) {
            return variants_of(
                {{"events", beside_work("policy: SCHED_FIFO, priority: 40", "type: events"), ""},
                 {"let_servers",
                  beside_work("policy: SCHED_DEADLINE, runtime: 4ms, period: 10ms",
                              "type: triggered, let: 10ms"),
                  ""}});
          },
      .deviations = {kWorkload, "One reservation instead of two that take turns."},
      .is_of_paper = false,
      .claims = {
          {"The latency of a chain hardly varies.", "chain_spread_ms", "let_servers", "events"}}};
}

Experiment of_paam() {
  return {.name = "paam",
          .title = "An accelerator serves critical chains first (RTAS 2024)",
          .x_label = "",
          .metrics = {"chain_p99_ms", "chain_max_ms"},
          .variants =
              [](const BenchOptions&) {
                return variants_of({{"fifo", accelerator("fifo"), ""},
                                    {"paam", accelerator("chain_priority"), ""}});
              },
          .deviations = {kWorkload, "A thread stands for the accelerator."},
          .is_of_paper = false,
          .claims = {{"The latency of critical chains becomes shorter (by up to 91 %).",
                      "chain_p99_ms", "paam", "fifo"}}};
}

Experiment of_anytime() {
  return {
      .name = "anytime",
      .title = "Long work in batches (Teper et al., RTAS 2026)",
      .x_label = "",
      .metrics = {"served_percent"},
      .variants = anytime,
      .deviations = {"The planner of examples/21_batches: 200 ms at once, or in batches "
                     "of 1 ms. Not simulated: its code says no times."},
      .is_of_paper = false,
      .claims = {{"A second timer misses fewer periods.", "served_percent", "whole", "batches"}}};
}

}  // namespace

std::vector<Experiment> literature() {
  return {on_three_chains("picas", "PiCAS (Choi et al., RTAS 2021)",
                          {{"The latency of the most critical chain becomes shorter.",
                            "chain_p99_ms", "picas", "multi"}}),
          on_three_chains("picas_mt", "PiCAS in a pool (Sobhani et al., RTAS 2023)",
                          {{"The latency of critical chains becomes shorter.", "chain_p99_ms",
                            "picas_mt", "multi"}}),
          on_three_chains(
              "redagrt", "One queue over all graphs (arXiv 2603.18238)",
              {{"The p99 latency becomes shorter (by 42.9 %).", "chain_p99_ms", "redagrt", "multi"},
               {"More instances are in time (29.7 % fewer misses).", "in_time_percent", "multi",
                "redagrt"}}),
          of_events_priority(),
          of_edf_dag(),
          of_preemptive(),
          of_mt_fair(),
          of_cie(),
          of_let_servers(),
          of_paam(),
          of_anytime()};
}

}  // namespace takt::tools
