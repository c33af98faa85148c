// The fixture of the conformance suite: every executor × every scheduler, from the registries.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_CONFORMANCE_CONFORMANCE_HPP_
#define TAKT_EXECUTORS_CONFORMANCE_CONFORMANCE_HPP_

#include <cstdlib>
#include <latch>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/testing/eventually.hpp"

namespace takt::conformance {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

struct Number {
  int value = 0;
};
TAKT_MESSAGE(Number, "test/msg/Number", value);

/// Rounds of the randomised tests: few in `./dev test`, a million in `./dev stress`.
inline int stress_rounds() {
  const char* rounds = std::getenv("TAKT_STRESS_ROUNDS");
  return rounds != nullptr ? std::atoi(rounds) : 10'000;
}

/// The CPUs that manual clocks simulate, as many as TAKT_VIRTUAL_CPUS says (`./dev stress` sets
/// it); none: each thread has a CPU of its own.
inline std::vector<int> virtual_cpus() {
  const char* const count = std::getenv("TAKT_VIRTUAL_CPUS");
  std::vector<int> cpus(count != nullptr ? std::strtoul(count, nullptr, 10) : 0);
  std::iota(cpus.begin(), cpus.end(), 0);
  return cpus;
}

/// The executor that a test's parameter names: a registered one, or a variant of one, by a suffix.
/// `_per_group`: one that isolates, with a thread for each group, and two for a reentrant one.
/// `_two_workers` and `_four_workers`: one that has several workers only where the options say so,
/// and has no workers' policy.
class ExecutorKind {
 public:
  static constexpr std::string_view kPerGroup = "_per_group", kTwo = "_two_workers",
                                    kFour = "_four_workers";

  static constexpr std::size_t kReentrantThreads = 2;

  explicit ExecutorKind(const std::string& name) : type(name) {
    for (const std::string_view ending : {kPerGroup, kTwo, kFour}) {
      if (!name.ends_with(ending)) continue;
      type.resize(name.size() - ending.size());
      is_per_group = ending == kPerGroup;
      asked_workers_ = ending == kTwo ? 2 : ending == kFour ? 4 : 0;
    }
    traits = executors().traits(type);
  }

  std::size_t workers() const { return asked_workers_ != 0 ? asked_workers_ : traits.pool ? 2 : 1; }
  std::unique_ptr<Executor> make(ExecutorOptions options) const {
    if (is_per_group) {
      options.per = Isolation::group;
      const bool is_limited = options.wait != kAutoWait &&
                              wait_backends().traits(options.wait).max_workers < kReentrantThreads;
      if (!is_limited) options.reentrant_threads = kReentrantThreads;
    }
    if (options.threads.empty()) options.threads.resize(asked_workers_);
    return executors().make(type, options);
  }

  bool is_per_group = false;
  std::string type;  // the registered name
  ExecutorTraits traits;

 private:
  std::size_t asked_workers_ = 0;
};

/// Why a test that relies on SchedulerTraits::takes_turns does not run.
inline constexpr const char* kNoTurns =
    "the traits of the scheduler say that it does not take turns";

/// Why a test of `spin` does not run.
inline constexpr const char* kNoSpin = "its workers are told apart, and spin for nobody";

inline std::vector<std::string> executor_names() {
  std::vector<std::string> names = executors().names();
  for (const std::string& name : executors().names()) {
    const ExecutorTraits traits = executors().traits(name);
    if (traits.isolates) {
      names.push_back(name + std::string(ExecutorKind::kPerGroup));
    } else if (traits.max_threads > 1 && !traits.pool && traits.workers == nullptr) {
      names.push_back(name + std::string(ExecutorKind::kTwo));
      names.push_back(name + std::string(ExecutorKind::kFour));
    }
  }
  return names;
}

class Conformance : public ::testing::TestWithParam<std::tuple<std::string, std::string>> {
 protected:
  const std::string& executor_name() const { return std::get<0>(GetParam()); }
  const std::string& scheduler_name() const { return std::get<1>(GetParam()); }
  bool takes_turns() const { return schedulers().traits(scheduler_name()).takes_turns; }
  bool is_per_group() const { return kind_.is_per_group; }
  bool is_isolated() const { return traits_.isolates; }
  bool is_frozen() const { return traits_.frozen; }
  bool is_pool() const { return workers() > 1; }
  /// Of an executor whose options do not say how many; if it isolates, of each of its children.
  std::size_t workers() const { return kind_.workers(); }
  /// The same for a reentrant group.
  std::size_t reentrant_workers() const {
    return is_per_group() ? ExecutorKind::kReentrantThreads : workers();
  }
  /// Threads that a manual clock waits for, where all nodes of a test have one group, of this type.
  std::size_t participants(CallbackGroupType type = CallbackGroupType::MutuallyExclusive) const {
    const bool is_reentrant = type == CallbackGroupType::Reentrant;
    const std::size_t of_group = is_reentrant ? reentrant_workers() : workers();
    return is_isolated() ? of_group + 1 : of_group;
  }
  /// How many workers a test may ask for, if they have to run callbacks at the same time.
  std::size_t most_workers() const { return traits_.workers != nullptr ? 1 : traits_.max_threads; }
  bool is_event_driven() const { return traits_.readiness == Readiness::events; }

  std::unique_ptr<Executor> make(Clock& clock, std::size_t of_a_pool = 0) const {
    ExecutorOptions options;
    options.name = "conformance";
    options.scheduler = scheduler_name();
    options.clock = &clock;
    if (is_pool()) options.threads.resize(of_a_pool != 0 ? of_a_pool : workers());
    return make(options);
  }
  std::unique_ptr<Executor> make(const ExecutorOptions& options) const {
    return kind_.make(options);
  }
  std::shared_ptr<Node> make_node(Clock& clock, const std::string& name = "node") const {
    NodeOptions options;
    options.clock = &clock;
    return std::make_shared<Node>(name, options);
  }

  const ExecutorKind kind_{executor_name()};
  const ExecutorTraits& traits_ = kind_.traits;
};

/// Spins on a thread of its own, and cancels and joins at the end.
class SpinThread {
 public:
  explicit SpinThread(Executor& executor) : executor_(executor) {
    thread_ = std::thread([this] {
      try {
        executor_.spin();
      } catch (...) {
        exception = std::current_exception();
      }
    });
  }
  ~SpinThread() { stop(); }
  void stop() {
    if (thread_.joinable()) executor_.cancel();
    join();
  }
  void join() {
    if (thread_.joinable()) thread_.join();
  }
  std::exception_ptr exception;

 private:
  Executor& executor_;
  std::thread thread_;
};

/// The same under a manual clock: nothing runs but inside `advance`.
class ManualSpin {
 public:
  ManualSpin(Executor& executor, ManualClock& clock, std::size_t participants)
      : executor_(executor), clock_(clock), thread_([&executor] { executor.spin(); }) {
    clock_.wait_for_participants(participants);
  }
  ~ManualSpin() {
    executor_.cancel();
    clock_.advance(1h);  // a callback may be in the middle of its work
    thread_.join();
  }

 private:
  Executor& executor_;
  ManualClock& clock_;
  std::thread thread_;
};

/// For each suite, once: every executor that is registered under every scheduler that is.
#define TAKT_INSTANTIATE_CONFORMANCE(Suite)                          \
  INSTANTIATE_TEST_SUITE_P(                                          \
      Every, Suite,                                                  \
      ::testing::Combine(::testing::ValuesIn(executor_names()),      \
                         ::testing::ValuesIn(schedulers().names())), \
      [](const auto& pair) { return std::get<0>(pair.param) + "__" + std::get<1>(pair.param); })

}  // namespace takt::conformance

#endif  // TAKT_EXECUTORS_CONFORMANCE_CONFORMANCE_HPP_
