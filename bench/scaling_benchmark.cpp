// What do more workers bring? A row is an executor that takes several, a kind of work, and a number
// of workers. Its rounds alternate: one worker, these workers, and `apart`: as many executors with
// one worker each, which share nothing. The counters are medians, and ratios with their 95 %
// intervals:
// - alone_ns: from one callback to the next, with one worker.
// - gain: callbacks in the same time, against one worker. gain_apart: of the executors apart.
// - of_apart: against these.
// - cpu: CPU time of a callback, against one worker.
// - least_share: what the worker that ran the fewest callbacks ran, against an equal share.
// - line_ns: what a bare cache line takes from the first CPU to the second, and its quartiles. Work
//   that is shared costs several such ways, and a virtual machine's CPUs may move during a run.
// Eight callbacks trigger themselves (`independent`; `reentrant`: in groups of that kind;
// `one_group`: in one exclusive group), or each triggers the next (`chain`). Then only one is ready
// at a time, as in one group, and workers can bring nothing.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <numeric>
#include <string>
#include <thread>

#include <benchmark/benchmark.h>

#include "takt/base/spin_pause.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/machine.hpp"
#include "takt/measuring/rounds.hpp"
#include "takt/nodes/node.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kCallbacks = 8, kMostWorkers = 64;

// Work is a number of steps, not a time: what another program takes from a worker is not work.
void work(std::uint64_t steps) {
  std::uint64_t value = steps;
  for (std::uint64_t i = 0; i < steps; ++i) benchmark::DoNotOptimize(value = value * 3 + 1);
}

std::uint64_t steps_in(Nanoseconds duration) {
  static const double steps_per_ns = [] {
    constexpr std::uint64_t kSteps = 10'000;
    Nanoseconds shortest = Nanoseconds::max();
    for (int i = 0; i < 1000; ++i) {
      const TimePoint start = Clock::steady().now();
      work(kSteps);
      shortest = std::min<Nanoseconds>(shortest, Clock::steady().now() - start);
    }
    return static_cast<double>(kSteps) / static_cast<double>(shortest.count());
  }();
  return static_cast<std::uint64_t>(steps_per_ns * static_cast<double>(duration.count()));
}

enum class Shape { independent, reentrant, one_group, chain };

struct Row {
  std::string executor;
  Shape shape;
  Nanoseconds work;
  std::size_t workers;
};

// ---- One executor ----

/// How many callbacks each of its workers ran.
struct alignas(64) Count {
  std::uint64_t callbacks = 0;
};

class System {
 public:
  /// Its workers run on the CPUs from this one on.
  System(const Row& row, std::size_t workers, std::size_t callbacks, std::size_t first_cpu)
      : steps_(steps_in(row.work)), counts_(kMostWorkers) {
    ExecutorOptions options;
    options.statistics = StatisticsLevel::count;
    options.realtime = Realtime::off;  // policy and priority are those of this program
    options.threads.resize(workers);
    const std::vector<int> cpus = available_cpus();
    for (std::size_t i = 0; i < workers; ++i) {
      options.threads[i].affinity = {cpus[(first_cpu + i) % cpus.size()]};
    }
    executor_ = executors().make(row.executor, options);
    const auto type = row.shape == Shape::reentrant ? CallbackGroupType::Reentrant
                                                    : CallbackGroupType::MutuallyExclusive;
    std::shared_ptr<CallbackGroup> group;
    for (std::size_t i = 0; i < callbacks; ++i) {
      if (i == 0 || row.shape != Shape::one_group) {
        group = node_->create_callback_group("group_" + std::to_string(i), type);
      }
      const std::size_t next = row.shape == Shape::chain ? (i + 1) % callbacks : i;
      conditions_.push_back(node_->create_guard_condition(
          "condition_" + std::to_string(i),
          [this, next] {
            work(steps_);
            ++mine().callbacks;
            conditions_[next]->trigger();
          },
          group));
    }
    executor_->add_node(node_);
    conditions_[0]->trigger();
    if (row.shape != Shape::chain) {
      for (const auto& condition : conditions_) condition->trigger();
    }
  }

  /// Until another thread cancels.
  void spin() { executor_->spin(); }
  void cancel() { executor_->cancel(); }
  const std::vector<Count>& counts() const { return counts_; }

 private:
  // Each thread has an entry of its own, as long as the system lives.
  Count& mine() {
    thread_local std::pair<const System*, Count*> entry;
    if (entry.first != this) entry = {this, &counts_[threads_.fetch_add(1)]};
    return *entry.second;
  }

  const std::uint64_t steps_;
  std::vector<Count> counts_;
  std::atomic<std::size_t> threads_{0};
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node");
  std::vector<std::shared_ptr<GuardCondition>> conditions_;
  std::unique_ptr<Executor> executor_;
};

// ---- Measuring ----

struct Result {
  double callbacks_per_s = 0, cpu_ns = 0, least_share = 1;
};

double cpu_time_ns() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e9 + static_cast<double>(now.tv_nsec);
}

/// Runs these systems at the same time, each on a thread of its own.
Result run(std::vector<std::unique_ptr<System>> systems, std::size_t workers) {
  constexpr auto kDuration = 50ms;
  const double cpu_before = cpu_time_ns();
  const TimePoint start = Clock::steady().now();
  std::vector<std::jthread> spinners;
  for (const auto& system : systems) spinners.emplace_back([&system] { system->spin(); });
  std::this_thread::sleep_for(kDuration);
  for (const auto& system : systems) system->cancel();
  spinners.clear();
  const auto elapsed = std::chrono::duration<double>(Clock::steady().now() - start);
  std::vector<double> counts;
  for (const auto& system : systems) {
    for (const Count& count : system->counts()) {
      counts.push_back(static_cast<double>(count.callbacks));
    }
  }
  std::sort(counts.rbegin(), counts.rend());
  const double sum = std::accumulate(counts.begin(), counts.end(), 0.0);
  return {sum / elapsed.count(), (cpu_time_ns() - cpu_before) / sum,
          counts[workers - 1] * static_cast<double>(workers) / sum};
}

Result run_together(const Row& row, std::size_t workers) {
  std::vector<std::unique_ptr<System>> systems;
  systems.push_back(std::make_unique<System>(row, workers, kCallbacks, 0));
  return run(std::move(systems), workers);
}

Result run_apart(const Row& row) {
  std::vector<std::unique_ptr<System>> systems;
  for (std::size_t i = 0; i < row.workers; ++i) {
    systems.push_back(std::make_unique<System>(row, 1, kCallbacks / row.workers, i));
  }
  return run(std::move(systems), row.workers);
}

/// 0 where there is only one CPU.
double cache_line_ns() {
  constexpr std::uint32_t kWays = 2000;
  if (available_cpus().size() < 2) return 0;
  struct alignas(64) Line {
    std::atomic<std::uint32_t> ways{0};
  } line;
  double result = 0;
  const auto go = [&](std::uint32_t first) {
    rt::stay_on(first);
    TimePoint start;
    for (std::uint32_t way = first; way < kWays; way += 2) {
      while (line.ways.load(std::memory_order_acquire) != way) spin_pause();
      if (way == 2) start = Clock::steady().now();  // both threads are there
      line.ways.store(way + 1, std::memory_order_release);
    }
    if (first != 0) return;
    const std::chrono::duration<double, std::nano> elapsed = Clock::steady().now() - start;
    result = elapsed.count() / (kWays - 4);
  };
  std::jthread there(go, 0), back(go, 1);
  there.join();
  return result;
}

void scaling(benchmark::State& state, const Row& row) {
  std::array<std::vector<double>, 3> speed, cpu;
  std::vector<double> least_share, line_ns;
  for ([[maybe_unused]] auto _ : state) {
    const std::array<Result, 3> round{run_together(row, 1), run_together(row, row.workers),
                                      run_apart(row)};
    for (std::size_t i = 0; i < round.size(); ++i) {
      speed[i].push_back(round[i].callbacks_per_s);
      cpu[i].push_back(round[i].cpu_ns);
    }
    least_share.push_back(round[1].least_share);
    line_ns.push_back(cache_line_ns());
  }
  const auto report = [&](const std::string& name, const auto& values, const auto& to) {
    const rt::Interval ratio = rt::paired_ratio(values, to);
    state.counters[name] = ratio.median;
    state.counters[name + "_low"] = ratio.low;
    state.counters[name + "_high"] = ratio.high;
  };
  state.counters["alone_ns"] = 1e9 / rt::median(speed[0]);
  report("gain", speed[1], speed[0]);
  report("gain_apart", speed[2], speed[0]);
  report("of_apart", speed[1], speed[2]);
  report("cpu", cpu[1], cpu[0]);
  state.counters["least_share"] = rt::median(least_share);
  for (const auto& [name, fraction] :
       {std::pair{"line_p25_ns", 0.25}, {"line_ns", 0.5}, {"line_p75_ns", 0.75}}) {
    state.counters[name] = rt::quantile(line_ns, fraction);
  }
}

const char* name_of(Shape shape) {
  switch (shape) {
    case Shape::independent:
      return "independent";
    case Shape::reentrant:
      return "reentrant";
    case Shape::one_group:
      return "one_group";
    case Shape::chain:
      return "chain";
  }
  return "";
}

[[maybe_unused]] const bool registered = [] {
  constexpr int kRounds = 20;
  for (const std::string& executor : executors().names()) {
    if (executors().traits(executor).max_threads == 1 || executors().traits(executor).isolates)
      continue;
    for (const Shape shape :
         {Shape::independent, Shape::reentrant, Shape::one_group, Shape::chain}) {
      for (const Nanoseconds work :
           {Nanoseconds(0), Nanoseconds(1us), Nanoseconds(10us), Nanoseconds(100us)}) {
        for (const std::size_t workers : {2u, 4u}) {
          const std::string name = executor + "/" + name_of(shape) +
                                   "/work_us:" + std::to_string(work / 1us) +
                                   "/workers:" + std::to_string(workers);
          benchmark::RegisterBenchmark(name.c_str(), scaling, Row{executor, shape, work, workers})
              ->Iterations(kRounds)
              ->UseRealTime();
        }
      }
    }
  }
  return true;
}();

}  // namespace
}  // namespace takt
