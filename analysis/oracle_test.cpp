// The real executors against the simulation with which the bounds are compared: the same
// executions at the same times, so that what is shown of one holds for the other.
// SPDX-License-Identifier: Apache-2.0
#include "takt/testing/oracle.hpp"

#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/testing/random_system.hpp"

namespace takt::analysis {
namespace {

using conformance::Number;
using testing::Oracle;
using testing::RandomSystem;
using testing::Shape;

/// Callback, start, end; in order of the ends.
using Executions = std::vector<std::tuple<std::size_t, Time, Time>>;

/// How the executors of a system are made.
struct Made {
  std::string type, scheduler;
};

/// A system on real executors, under a manual clock.
class Real {
 public:
  Real(RandomSystem& random, const std::vector<Made>& made, const std::vector<Time>& phases,
       const std::vector<int>& cpus = {})
      : random_(random), clock_({}, clock_of(random, cpus)) {
    const System& system = random.system;
    for (std::size_t i = 0; i < system.executors.size(); ++i) make_executor(i, made[i]);
    std::map<std::size_t, std::shared_ptr<CallbackGroup>> groups;
    std::vector<CallbackParameterChanges> parameters_of_all(nodes_.size());
    for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
      const Callback& callback = system.callbacks[i];
      const auto& node = nodes_[callback.executor];
      auto& group = groups[callback.group];
      if (group == nullptr) {
        group = node->create_callback_group("group_" + std::to_string(callback.group),
                                            CallbackGroupType::MutuallyExclusive);
      }
      publishers_.emplace_back();
      for (const Output& output : callback.outputs) {
        publishers_.back().push_back(node->create_publisher<Number>(input(output.to), QoS(kDepth)));
      }
      const auto execute = [this, i] { this->execute(i); };
      const std::string name = callback.name;
      std::shared_ptr<Entity> entity;
      if (callback.is_timer) {
        const auto timer = node->create_timer(name, Nanoseconds(random.period(i)), execute, group);
        timer->release_at(TimePoint(Nanoseconds(phases[i])));
        entity = timer;
      } else {
        entity = node->create_subscription<Number>(
            input(i), QoS(kDepth), [execute](const Number&) { execute(); }, group);
      }
      CallbackParameters parameters{.priority = static_cast<int>(callback.urgency)};
      if (callback.point < kUnbounded) {
        const Nanoseconds budget(made[callback.executor].scheduler == "least_laxity" ? 7 : 0);
        parameters.deadline = Nanoseconds(callback.point) + budget;
        if (budget != Nanoseconds::zero()) parameters.budget = budget;
      }
      parameters_of_all[callback.executor].callbacks[entity->name()] = parameters;
      entities_.push_back(entity);
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      nodes_[i]->set_callback_parameters(parameters_of_all[i]);
    run(made);
  }

  Executions result;
  static constexpr Time kEnd = 1500;

 private:
  static constexpr std::size_t kDepth = 1000;
  static std::string input(std::size_t callback) { return "to_" + std::to_string(callback); }

  static CpuModel::Options clock_of(const RandomSystem& random, const std::vector<int>& cpus) {
    CpuModel::Options options{.wake = Nanoseconds(random.system.overheads.wake)};
    for (const int cpu : cpus) options.cpus.push_back({.number = cpu});
    return options;
  }

  void make_executor(std::size_t index, const Made& made) {
    const Executor& described = random_.system.executors[index];
    ThreadAttributes thread;
    if (described.share) {
      thread.policy = ThreadPolicy::fifo;
      thread.priority = described.share->priority;
      thread.affinity = described.share->cpus;
    } else if (described.reservation) {
      thread.policy = ThreadPolicy::deadline;
      thread.runtime = Nanoseconds(described.reservation->budget);
      thread.period = Nanoseconds(described.reservation->period);
    }
    ExecutorOptions options;
    options.scheduler = made.scheduler;
    options.clock = &clock_;
    options.statistics = StatisticsLevel::full;  // it looks at its timers before each dispatch
    options.threads.assign(described.threads, thread);
    options.trigger.let_period = Nanoseconds(described.let_period);
    options.trigger.most_outputs = 10'000;
    executors_.push_back(executors().make(made.type, options));
    nodes_.push_back(
        std::make_shared<Node>("system_" + std::to_string(index), NodeOptions{.clock = &clock_}));
    executors_.back()->add_node(nodes_.back());  // callbacks count in the order they are made
  }

  void run(const std::vector<Made>& made) {
    std::vector<std::thread> threads;
    std::size_t participants = 0;
    for (std::size_t i = 0; i < executors_.size(); ++i) {
      threads.emplace_back([executor = executors_[i].get()] { executor->spin(); });
      // That which isolates has one more, which runs no callbacks.
      participants += random_.system.executors[i].threads + (made[i].type == "isolated" ? 1 : 0);
    }
    clock_.wait_for_participants(participants);
    clock_.advance(Nanoseconds(kEnd));
    result = executions_;
    for (const auto& executor : executors_) executor->cancel();
    clock_.advance(std::chrono::hours(1));  // a callback may be in the middle of its work
    for (std::thread& thread : threads) thread.join();
  }

  void execute(std::size_t callback) {
    const Time start = now();
    clock_.work(Nanoseconds(random_.system.callbacks[callback].execution +
                            random_.system.overheads.dispatch));
    executions_.emplace_back(callback, start, now());
    for (std::size_t i = 0; i < publishers_[callback].size(); ++i) {
      const Output& output = random_.system.callbacks[callback].outputs[i];
      if (!output.waits || is_last_input(callback, output.to)) {
        publishers_[callback][i]->publish(Number{});
      }
    }
  }
  // Of a join: whether all others have run since its last message.
  bool is_last_input(std::size_t callback, std::size_t to) {
    auto& inputs = inputs_[to];
    inputs.insert(callback);
    for (std::size_t other = 0; other < random_.system.callbacks.size(); ++other) {
      for (const Output& output : random_.system.callbacks[other].outputs) {
        if (output.waits && output.to == to && !inputs.contains(other)) return false;
      }
    }
    inputs.clear();
    return true;
  }
  Time now() const { return clock_.now().time_since_epoch().count(); }

  RandomSystem& random_;
  ManualClock clock_;
  std::vector<std::shared_ptr<Node>> nodes_;  // as the executors
  std::vector<std::vector<std::shared_ptr<Publisher<Number>>>> publishers_;
  std::vector<std::shared_ptr<Entity>> entities_;
  std::map<std::size_t, std::set<std::size_t>> inputs_;  // of joins
  std::vector<std::unique_ptr<takt::Executor>> executors_;
  Executions executions_;
};

/// What the scheduler makes of a system of random numbers.
void give_order(System& system, std::size_t executor, const std::string& scheduler) {
  system.executors[executor].order = schedulers().traits(scheduler).order;
  if (scheduler != "listed") return;
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
    if (system.callbacks[i].executor == executor) system.callbacks[i].place = i;
  }
}

/// One that does what is described; of those that do the same, each in turn.
std::string type_of(const Executor& executor, std::uint64_t seed) {
  if (!executor.is_wait_set) return "events";
  if (executor.threads > 1) return "multi_threaded";
  if (executor.let_period > 0) return "triggered";
  constexpr const char* kTypes[] = {"single_threaded", "static_single_threaded", "triggered",
                                    "isolated"};
  return kTypes[seed % std::size(kTypes)];
}

std::vector<Time> phases_of(RandomSystem& random) {
  std::vector<Time> phases(random.system.callbacks.size());
  for (std::size_t i = 0; i < phases.size(); ++i) {
    // From 1: what is due before the threads begin, depends on when they do.
    const bool is_timer = random.system.callbacks[i].is_timer;
    phases[i] = is_timer ? static_cast<Time>(random.between(1, random.period(i))) : 0;
  }
  return phases;
}

/// How many executions are the same; fails if not all are.
std::size_t compare(RandomSystem& random, const std::vector<Made>& made, std::uint64_t seed,
                    const std::vector<int>& cpus = {}) {
  const std::vector<Time> phases = phases_of(random);
  const Real real(random, made, phases, cpus);
  Executions expected;
  const auto worst = [&random](std::size_t callback) {
    return random.system.callbacks[callback].execution;
  };
  const Oracle oracle(random.system, {phases, worst, Real::kEnd, {}, false, cpus});
  for (const auto& job : oracle.jobs()) {
    expected.emplace_back(job->callback, job->start, job->end);
  }
  const auto [first, other] =
      std::mismatch(real.result.begin(), real.result.end(), expected.begin(), expected.end());
  EXPECT_EQ(::testing::PrintToString(Executions(first, real.result.end())),
            ::testing::PrintToString(Executions(other, expected.end())))
      << made.front().type << ", " << made.front().scheduler << ", seed " << seed
      << ", from execution " << first - real.result.begin() << " on:\n"
      << testing::described(random.system);
  return expected.size();
}

// Overload, shared groups, forks, subscriptions of several publishers, one to three threads,
// logical execution time.
TEST(Oracle, TheExecutorsDoWhatItSays) {
  Shape shape;
  shape.most_executors = 1;
  shape.shares_cpus = false;
  shape.has_periods = true;
  std::map<std::string, std::size_t> executions;
  const auto names = schedulers().names();
  const std::uint64_t systems_of_each = testing::random_systems(320) / names.size();
  for (const std::string& scheduler : names) {
    for (std::uint64_t seed = 1; seed <= systems_of_each; ++seed) {
      RandomSystem random(seed, shape);
      give_order(random.system, 0, scheduler);
      const std::string type = type_of(random.system.executors.front(), seed);
      executions[type] += compare(random, {{type, scheduler}}, seed);
      if (HasFailure()) return;
    }
  }
  for (const auto& [type, count] : executions) {
    std::printf("%-22s %7zu executions are the same\n", type.c_str(), count);
  }
}

// Of 60,000 systems these showed that a window stayed where a worker parked what another one would
// have found; and that the oracle took what a worker finds ready for announced.
TEST(Oracle, TheExecutorsDoWhatItSaysInRareSystems) {
  Shape shape;
  shape.most_executors = 1;
  shape.shares_cpus = false;
  shape.has_periods = true;
  for (const auto& [made, seed] : {std::pair(Made{"events", "listed"}, 339),
                                   std::pair(Made{"multi_threaded", "round_robin"}, 510)}) {
    RandomSystem random(static_cast<std::uint64_t>(seed), shape);
    give_order(random.system, 0, made.scheduler);
    EXPECT_GT(compare(random, {made}, static_cast<std::uint64_t>(seed)), 0u);
  }
}

// Several executors, on threads that share two CPUs by priority, have reservations, or a CPU of
// their own; and it takes time to wake up and to dispatch.
TEST(Oracle, TheCpusDoWhatItSays) {
  Shape shape;
  shape.has_threads = false;  // pools are compared above
  shape.floats = true;
  shape.has_overheads = true;
  const auto names = schedulers().names();
  std::size_t executions = 0, reservations = 0;
  for (std::uint64_t seed = 1; seed <= testing::random_systems(300); ++seed) {
    RandomSystem random(seed, shape);
    System& system = random.system;
    std::vector<int> cpus{0, 1};
    std::vector<Made> made;
    for (std::size_t i = 0; i < system.executors.size(); ++i) {
      Executor& executor = system.executors[i];
      const std::string& scheduler = names[random.between(0, names.size() - 1)];
      give_order(system, i, scheduler);
      made.push_back({type_of(executor, seed + i), scheduler});
      reservations += executor.reservation ? 1 : 0;
      if (executor.share || executor.reservation) continue;
      executor.share = Executor::Share{.cpus = {}, .priority = 1};
      for (std::size_t thread = 0; thread < executor.threads; ++thread) {
        executor.share->cpus.push_back(static_cast<int>(cpus.size()));
        cpus.push_back(static_cast<int>(cpus.size()));
      }
    }
    executions += compare(random, made, seed, cpus);
    if (HasFailure()) return;
  }
  EXPECT_GT(reservations, 0u);
  std::printf("%zu executions are the same, with %zu reservations\n", executions, reservations);
}

}  // namespace
}  // namespace takt::analysis
