// The real executors against the simulation with which the bounds are compared: the same
// executions at the same times, so that what is shown of one holds for the other.
// SPDX-License-Identifier: Apache-2.0
#include "takt/testing/oracle.hpp"

#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/testing/random_system.hpp"

namespace takt::analysis {
namespace {

using conformance::ManualSpin;
using conformance::Number;
using testing::Oracle;
using testing::RandomSystem;
using testing::Shape;

/// Callback, start, end; in order of the ends.
using Executions = std::vector<std::tuple<std::size_t, Time, Time>>;

/// One executor with what it runs, from a system of one.
class Real {
 public:
  Real(RandomSystem& random, const std::string& type, const std::string& scheduler,
       const std::vector<Time>& phases)
      : random_(random) {
    const System& system = random.system;
    const Executor& described = system.executors.front();
    ExecutorOptions options;
    options.scheduler = scheduler;
    options.clock = &clock_;
    options.statistics = StatisticsLevel::full;  // it looks at its timers before each dispatch
    options.threads.resize(described.threads);
    options.trigger.let_period = Nanoseconds(described.let_period);
    options.trigger.most_outputs = 10'000;
    const auto executor = executors().make(type, options);
    executor->add_node(node_);  // first: callbacks count in the order in which they are made
    std::map<std::size_t, std::shared_ptr<CallbackGroup>> groups;
    CallbackParameterChanges parameters_of_all;
    for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
      const Callback& callback = system.callbacks[i];
      auto& group = groups[callback.group];
      if (group == nullptr) {
        group = node_->create_callback_group("group_" + std::to_string(callback.group),
                                             CallbackGroupType::MutuallyExclusive);
      }
      publishers_.emplace_back();
      for (const Output& output : callback.outputs) {
        publishers_.back().push_back(
            node_->create_publisher<Number>(input(output.to), QoS(kDepth)));
      }
      const auto execute = [this, i] { this->execute(i); };
      const std::string name = callback.name;
      std::shared_ptr<Entity> entity;
      if (callback.is_timer) {
        const auto timer = node_->create_timer(name, Nanoseconds(random.period(i)), execute, group);
        timer->release_at(TimePoint(Nanoseconds(phases[i])));
        entity = timer;
      } else {
        entity = node_->create_subscription<Number>(
            input(i), QoS(kDepth), [execute](const Number&) { execute(); }, group);
      }
      CallbackParameters parameters{.priority = static_cast<int>(callback.urgency)};
      if (callback.point < kUnbounded) {
        const Nanoseconds budget(scheduler == "least_laxity" ? 7 : 0);
        parameters.deadline = Nanoseconds(callback.point) + budget;
        if (budget != Nanoseconds::zero()) parameters.budget = budget;
      }
      parameters_of_all.callbacks[entity->name()] = parameters;
      entities_.push_back(entity);
    }
    node_->set_callback_parameters(parameters_of_all);
    // That which isolates has one more, which runs no callbacks.
    const ManualSpin spin(*executor, clock_, described.threads + (type == "isolated" ? 1 : 0));
    clock_.advance(Nanoseconds(kEnd));
    result = executions_;
  }

  Executions result;
  static constexpr Time kEnd = 1500;

 private:
  static constexpr std::size_t kDepth = 1000;
  static std::string input(std::size_t callback) { return "to_" + std::to_string(callback); }

  void execute(std::size_t callback) {
    const Time start = now();
    clock_.work(Nanoseconds(random_.system.callbacks[callback].execution));
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
  const std::shared_ptr<Node> node_ =
      std::make_shared<Node>("system", NodeOptions{.clock = &clock_});
  std::vector<std::vector<std::shared_ptr<Publisher<Number>>>> publishers_;
  std::vector<std::shared_ptr<Entity>> entities_;
  std::map<std::size_t, std::set<std::size_t>> inputs_;  // of joins
  Executions executions_;
};

/// What the scheduler makes of a system of random numbers.
void give_order(System& system, const std::string& scheduler) {
  system.executors.front().order = schedulers().traits(scheduler).order;
  if (scheduler != "listed") return;
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) system.callbacks[i].place = i;
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
      give_order(random.system, scheduler);
      std::vector<Time> phases(random.system.callbacks.size());
      for (std::size_t i = 0; i < phases.size(); ++i) {
        // From 1: what is due before the threads begin, depends on when they do.
        const bool is_timer = random.system.callbacks[i].is_timer;
        phases[i] = is_timer ? static_cast<Time>(random.between(1, random.period(i))) : 0;
      }
      const std::string type = type_of(random.system.executors.front(), seed);
      const Real real(random, type, scheduler, phases);
      Executions expected;
      const auto worst = [&random](std::size_t callback) {
        return random.system.callbacks[callback].execution;
      };
      const Oracle oracle(random.system, {phases, worst, Real::kEnd});
      for (const auto& job : oracle.jobs()) {
        expected.emplace_back(job->callback, job->start, job->end);
      }
      const auto [first, other] =
          std::mismatch(real.result.begin(), real.result.end(), expected.begin(), expected.end());
      ASSERT_EQ(::testing::PrintToString(Executions(first, real.result.end())),
                ::testing::PrintToString(Executions(other, expected.end())))
          << type << ", " << scheduler << ", seed " << seed << ", from execution "
          << first - real.result.begin() << " on:\n"
          << testing::described(random.system);
      executions[type] += expected.size();
    }
  }
  for (const auto& [type, count] : executions) {
    std::printf("%-22s %7zu executions are the same\n", type.c_str(), count);
  }
}

}  // namespace
}  // namespace takt::analysis
