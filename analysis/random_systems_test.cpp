// Bounds against a simulation of random systems: no response is ever longer, and for each method
// there is one that is as long.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>

#include <gtest/gtest.h>

#include "takt/analysis/analysis.hpp"
#include "takt/analysis/method.hpp"
#include "takt/testing/oracle.hpp"
#include "takt/testing/random_system.hpp"

namespace takt::analysis {
namespace {

using testing::Job;
using testing::Oracle;
using testing::RandomSystem;
using testing::Shape;

constexpr Time kEnd = 4000;

constexpr std::uint64_t kSystems = 3000 / kFewerSanitized;

Shape shape_of(std::uint64_t seed) {
  Shape shape;
  shape.has_periods = seed % 2 == 0;
  shape.has_overheads = seed % 4 == 1;
  shape.has_outside = seed % 3 == 0;
  shape.floats = seed % 7 == 0;
  if (seed % 5 == 0) shape.utilisations = {0.95, 0.98, 0.99, 1.0};
  return shape;
}

/// With the longest executions.
Oracle::Run run_of_any_phases(RandomSystem& random) {
  const System& system = random.system;
  Oracle::Run run{std::vector<Time>(system.callbacks.size()),
                  [&system](std::size_t callback) { return system.callbacks[callback].execution; },
                  kEnd};
  run.messages_first = random.is_one_of(2);
  const bool is_near = random.is_one_of(2);  // all begin with what blocks others for longest
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
    if (!system.callbacks[i].arrivals) continue;
    if (system.callbacks[i].is_timer) {
      const Time latest = is_near ? 2 : random.period(i);
      run.phases[i] = static_cast<Time>(random.between(0, latest));
      continue;
    }
    for (const Time time : random.arrivals(i, kEnd, is_near)) {
      run.messages.emplace_back(time, i);
    }
  }
  std::sort(run.messages.begin(), run.messages.end());
  return run;
}

std::vector<Oracle::Run> runs(RandomSystem& random) {
  const std::size_t count = random.system.callbacks.size();
  const auto worst = [&system = random.system](std::size_t callback) {
    return system.callbacks[callback].execution;
  };
  const auto any = [&random](std::size_t callback) { return random.execution(callback); };
  std::vector<Oracle::Run> result{{std::vector<Time>(count), worst, kEnd},
                                  {std::vector<Time>(count), worst, kEnd},
                                  {std::vector<Time>(count), any, kEnd}};
  result[1].messages_first = true;
  for (std::size_t i = 0; i < count; ++i) {
    const Callback& callback = random.system.callbacks[i];
    for (std::size_t run = 0; callback.arrivals && !callback.is_timer && run < result.size();
         ++run) {
      for (const Time time : random.arrivals(i, kEnd, run != 2)) {
        result[run].messages.emplace_back(time, i);
      }
    }
    if (!callback.is_timer) continue;
    // All but some are released just before these: what runs then, blocks them.
    result[1].phases[i] = random.is_one_of(3) ? 1 : 0;
    result[2].phases[i] = static_cast<Time>(random.between(0, random.period(i)));
  }
  for (Oracle::Run& run : result) std::sort(run.messages.begin(), run.messages.end());
  return result;
}

/// The longest responses of a run, as Bounds has them.
struct Observed {
  std::vector<Time> callbacks, chains;
};

/// Calls found(root, path) for all that the job goes back to; the path begins at its end.
template <class Found>
void follow(const Job& job, std::vector<std::size_t> path, const Found& found) {
  path.push_back(job.callback);
  if (job.cause == nullptr) return found(job, path);
  follow(*job.cause, path, found);
  for (const Job* other : job.joined) follow(*other, path, found);
}

Observed observe(const System& system, const Oracle& oracle) {
  Observed result{std::vector<Time>(system.callbacks.size()),
                  std::vector<Time>(system.chains.size())};
  std::map<std::vector<std::size_t>, std::size_t> chains;
  for (std::size_t i = 0; i < system.chains.size(); ++i) chains[system.chains[i].callbacks] = i;
  for (const auto& job : oracle.jobs()) {
    Time& longest = result.callbacks[job->callback];
    longest = std::max(longest, job->end - job->arrival);
    if (!system.callbacks[job->callback].outputs.empty()) continue;
    follow(*job, {}, [&](const Job& root, const std::vector<std::size_t>& path) {
      Time& longest_of_chain = result.chains[chains.at({path.rbegin(), path.rend()})];
      longest_of_chain = std::max(longest_of_chain, job->end - root.ready);
    });
  }
  return result;
}

/// The largest of observed ÷ bound.
struct Tightness {
  double callbacks = 0, chains = 0;
  std::size_t bounds = 0;
};

void compare(const System& system, const Observed& observed, const Bounds& bounds,
             Tightness& tightness, const std::string& method) {
  const auto check = [&](Time response, Time bound, double& largest, const std::string& of) {
    if (bound >= kUnbounded) return;
    ++tightness.bounds;
    largest = std::max(largest, static_cast<double>(response) / static_cast<double>(bound));
    EXPECT_LE(response, bound) << method << ": " << of;
  };
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
    check(observed.callbacks[i], bounds.callbacks[i].bound, tightness.callbacks,
          system.callbacks[i].name);
  }
  for (std::size_t i = 0; i < system.chains.size(); ++i) {
    check(observed.chains[i], bounds.chains[i].bound, tightness.chains, system.chains[i].name);
  }
}

/// The longest response seen ÷ the least bound, of all callbacks that a method bounds best.
using Shares = std::map<std::string, std::vector<double>>;

void add_shares(const System& system, const std::vector<Observed>& runs, Shares& shares) {
  const Bounds bounds = analyze(system, {.limit = 20'000});
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
    const CallbackBound& bound = bounds.callbacks[i];
    Time longest = 0;
    for (const Observed& run : runs) longest = std::max(longest, run.callbacks[i]);
    if (bound.bound >= kUnbounded || longest == 0) continue;
    const bool is_pool = system.executors[system.callbacks[i].executor].threads > 1;
    const double share = static_cast<double>(longest) / static_cast<double>(bound.bound);
    shares[bound.method + (is_pool ? " several" : " one")].push_back(share);
    if (is_pool) shares["all several"].push_back(share);
  }
}

// For docs/results/bounds.md: TAKT_TIGHTNESS_RUNS=30, further runs of each of 3,000 systems.
TEST(RandomSystems, TightnessOfBounds) {
  const char* const more = std::getenv("TAKT_TIGHTNESS_RUNS");
  const int further = more != nullptr ? std::atoi(more) : 0;
  Shares shares;
  for (std::uint64_t seed = 1; seed <= (further == 0 ? 100 : 3000); ++seed) {
    RandomSystem random(seed, shape_of(seed));
    std::vector<Observed> observed;
    const auto run_all = [&](std::vector<Oracle::Run> all) {
      for (Oracle::Run& run : all) {
        observed.push_back(observe(random.system, Oracle(random.system, std::move(run))));
      }
    };
    run_all(runs(random));
    for (int i = 0; i < further; ++i) run_all({run_of_any_phases(random)});
    add_shares(random.system, observed, shares);
  }
  EXPECT_GE(shares.size(), 8U);
  for (auto& [method, all] : shares) {
    std::sort(all.begin(), all.end());
    EXPECT_LE(all.back(), 1) << method;
    std::printf("tightness: %s %zu %.3f\n", method.c_str(), all.size(), all[all.size() / 2]);
  }
}

TEST(RandomSystems, NoResponseIsLongerThanAnyBound) {
  std::vector<std::vector<std::string>> sets{{}};
  for (const std::string& name : methods().names()) {
    // Its systems are in executors/preemptive_executor_test.cpp.
    if (!methods().traits(name).is_for_preemption) sets.push_back({name});
  }
  std::map<std::string, Tightness> tightness;
  std::vector<std::pair<std::uint64_t, Shape>> systems;
  const std::uint64_t count = testing::random_systems(kSystems);
  for (std::uint64_t seed = 1; seed <= count; ++seed) systems.emplace_back(seed, shape_of(seed));
  // Each refutes a bound of an earlier form, see tools/check/mutations.py. A change of what
  // RandomSystem draws makes other systems of these seeds: find new ones then.
  // A message that comes at the instant at which a less urgent callback begins; a timer that misses
  // releases before a join.
  for (const std::uint64_t seed : {1279, 33828}) systems.emplace_back(seed, Shape{});
  // Less urgent callbacks that begin while a thread of the same priority waits; a later message
  // that overtakes by a shorter way.
  for (const std::uint64_t seed : {2727, 249903}) {
    systems.emplace_back(seed, Shape{.has_outside = true});
  }
  // A snapshot on a CPU whose other thread is behind.
  systems.emplace_back(460, Shape{.has_periods = true, .utilisations = {0.95, 0.98, 0.99, 1.0}});
  // A join whose other input is sent at the end of a period; callbacks that exceed their period.
  for (const std::uint64_t seed : {1098, 2154}) {
    systems.emplace_back(seed, Shape{.has_periods = true});
  }
  // Few others show what a join holds back, and that it waits for its slowest input.
  systems.emplace_back(6373, Shape{.has_overheads = true});
  systems.emplace_back(17546, Shape{.has_periods = true});
  for (const auto& [seed, shape] : systems) {
    RandomSystem random(seed, shape);
    std::vector<Observed> observed;
    for (Oracle::Run& run : runs(random)) {
      observed.push_back(observe(random.system, Oracle(random.system, std::move(run))));
    }
    for (const auto& set : sets) {
      const Bounds bounds = analyze(random.system, {.methods = set, .limit = 20'000});
      const std::string name = set.empty() ? "the least of all" : set.front();
      for (const Observed& run : observed) {
        compare(random.system, run, bounds, tightness[name], name);
      }
    }
    ASSERT_FALSE(HasFailure()) << "seed " << seed << ":\n" << testing::described(random.system);
  }
  for (const auto& [name, found] : tightness) {
    std::printf(
        "%-16s %9zu bounds, largest observed ÷ bound: %.3f of a callback, %.3f of a chain\n",
        name.c_str(), found.bounds, found.callbacks, found.chains);
    if (count < 2000) continue;
    EXPECT_GE(found.callbacks, 0.95) << name;
  }
}

TEST(Analysis, MoreOverheadLowersNoBound) {
  for (std::uint64_t seed = 1; seed <= 200 / kFewerSanitized; ++seed) {
    testing::RandomSystem random(seed, {.has_overheads = true, .has_periods = true});
    Bounds before = analyze(random.system, {.limit = 100'000});
    for (Time Overheads::*const overhead :
         {&Overheads::dispatch, &Overheads::wake, &Overheads::context_switch}) {
      random.system.overheads.*overhead += 2;
      const Bounds after = analyze(random.system, {.limit = 100'000});
      for (std::size_t i = 0; i < after.callbacks.size(); ++i) {
        EXPECT_GE(after.callbacks[i].bound, before.callbacks[i].bound) << "seed " << seed;
      }
      for (std::size_t i = 0; i < after.chains.size(); ++i) {
        EXPECT_GE(after.chains[i].bound, before.chains[i].bound) << "seed " << seed;
      }
      before = after;
    }
  }
}

}  // namespace
}  // namespace takt::analysis
