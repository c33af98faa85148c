// Random systems of timers and subscriptions, for tests that compare.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_RANDOM_SYSTEM_HPP_
#define TAKT_TESTING_RANDOM_SYSTEM_HPP_

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/analysis/system.hpp"
#include "takt/testing/sanitized.hpp"

namespace takt::testing {

using analysis::Order;
using analysis::Time;

/// How many a test looks at: as many as it does in `./dev test`, unless `./dev stress` says more.
inline std::uint64_t random_systems(std::uint64_t usual) {
  const char* count = std::getenv("TAKT_RANDOM_SYSTEMS");
  return count != nullptr ? std::strtoull(count, nullptr, 10) : usual;
}

/// From which seed on: TAKT_FIRST_SEED, for other systems than each time.
inline std::uint64_t first_seed() {
  const char* first = std::getenv("TAKT_FIRST_SEED");
  return first != nullptr ? std::strtoull(first, nullptr, 10) : 1;
}

/// What a random system may have.
struct Shape {
  std::size_t most_executors = 4;
  bool has_threads = true;  // several for an executor
  bool has_joins = true;
  bool has_overheads = false;
  bool has_outside = false;  // messages from outside, also several at once
  bool has_periods = false;  // of logical execution time, in every other executor
  bool shares_cpus = true;   // and reservations
  bool floats = false;       // some threads may run on several CPUs
  std::vector<double> utilisations{0.3, 0.5, 0.7, 0.9, 0.97, 1.3};  // of an executor's CPU
};

class RandomSystem {
 public:
  RandomSystem(std::uint64_t seed, const Shape& shape) : random_(seed), shape_(shape) {
    make_executors();
    const std::size_t chains = between(1, 6);
    for (std::size_t i = 0; i < chains; ++i) make_chain();
    set_executions();
    set_orders();
    for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
      if (system.callbacks[i].arrivals) find_chains({i});
    }
    if (!shape_.has_overheads) return;
    system.overheads.dispatch = static_cast<Time>(between(0, 2));
    system.overheads.wake = static_cast<Time>(between(0, 9));
  }

  /// A number from first to last.
  std::size_t between(std::size_t first, std::size_t last) {
    return std::uniform_int_distribution<std::size_t>(first, last)(random_);
  }
  bool is_one_of(std::size_t count) { return between(1, count) == 1; }
  /// Of an execution, not longer than the longest.
  Time execution(std::size_t callback) {
    const analysis::Callback& described = system.callbacks[callback];
    return std::uniform_int_distribution<Time>(described.least_execution,
                                               described.execution)(random_);
  }
  Time period(std::size_t timer) const {
    return system.callbacks[timer].arrivals->least_distance(2);
  }

  /// Messages from outside at a callback, as close as they may come, or some of them later.
  std::vector<Time> arrivals(std::size_t callback, Time end, bool are_closest) {
    const analysis::ArrivalCurve& curve = *system.callbacks[callback].arrivals;
    std::vector<Time> result{are_closest ? 0 : static_cast<Time>(between(0, 100))};
    for (;;) {
      Time next =
          are_closest || !is_one_of(3) ? 0 : result.back() + static_cast<Time>(between(0, 99));
      for (std::size_t i = 0; i < result.size(); ++i) {
        const auto count = static_cast<analysis::Count>(result.size() - i + 1);
        next = std::max(next, result[i] + curve.least_distance(count));
      }
      if (next > end) return result;
      result.push_back(next);
    }
  }

  analysis::System system;

 private:
  void make_executors() {
    constexpr Order kOrders[] = {Order::by_urgency, Order::by_arrival, Order::by_point,
                                 Order::in_windows, Order::in_turns};
    const std::size_t count = between(1, shape_.most_executors);
    for (std::size_t i = 0; i < count; ++i) {
      analysis::Executor executor;
      executor.name = "executor_" + std::to_string(i);
      executor.order = kOrders[between(0, 4)];
      executor.is_wait_set = is_one_of(2);
      if (shape_.has_threads && is_one_of(3)) executor.threads = between(2, 3);
      if (shape_.shares_cpus && executor.threads == 1) {
        const std::size_t place = between(0, 9);
        if (place < 6) {
          std::vector<int> cpus{static_cast<int>(between(0, 1))};
          if (shape_.floats && is_one_of(2)) cpus = {0, 1};
          executor.share = {.cpus = std::move(cpus), .priority = static_cast<int>(between(1, 4))};
        } else if (place < 8) {
          const Time period = 10 * static_cast<Time>(between(1, 5));
          executor.reservation = {.budget = std::max<Time>(1, period * between(2, 9) / 10),
                                  .period = period};
        }
      }
      if (shape_.has_periods && executor.threads == 1 && is_one_of(2)) {
        executor.is_wait_set = true;
        executor.let_period = 10 * static_cast<Time>(between(2, 16));
      }
      system.executors.push_back(executor);
    }
  }

  void make_chain() {
    constexpr Time kPeriods[] = {40, 50, 60, 80, 100, 120, 150, 200, 240, 300, 400, 600};
    std::size_t last = add(between(0, system.executors.size() - 1), kPeriods[between(0, 11)]);
    system.callbacks[last].is_timer = true;
    system.callbacks[last].arrivals = analysis::ArrivalCurve::periodic(periods_[last]);
    system.callbacks[last].longest_gap = periods_[last];
    if (shape_.has_outside && is_one_of(2)) come_from_outside(last);
    const std::size_t first = last;
    for (std::size_t more = between(0, 3); more > 0; --more) {
      if (is_one_of(5)) last = between(first, system.callbacks.size() - 1);  // a fork
      if (is_one_of(10) && first > 0) {  // a subscription of several publishers
        const std::size_t other = between(0, first - 1);
        if (!system.callbacks[other].is_timer) {
          const bool is_linked = std::any_of(
              system.callbacks[last].outputs.begin(), system.callbacks[last].outputs.end(),
              [&](const analysis::Output& output) { return output.to == other; });
          if (!is_linked && !reaches(other, last))
            system.callbacks[last].outputs.push_back({.to = other});
          continue;
        }
      }
      const std::size_t executor =
          is_one_of(3) ? between(0, system.executors.size() - 1) : system.callbacks[last].executor;
      const std::size_t next = add(executor, periods_[last]);
      if (shape_.has_joins && first > 0 && is_one_of(6)) {  // of this chain and an earlier one
        const std::size_t other = between(0, first - 1);
        const bool paces = is_one_of(2);
        system.callbacks[last].outputs.push_back({.to = next, .messages = paces, .waits = true});
        system.callbacks[other].outputs.push_back({.to = next, .messages = !paces, .waits = true});
      } else {
        system.callbacks[last].outputs.push_back({.to = next});
        if (shape_.has_outside && is_one_of(4)) system.callbacks[last].outputs.back().messages = 2;
      }
      last = next;
    }
  }
  void come_from_outside(std::size_t callback) {
    analysis::Callback& described = system.callbacks[callback];
    described.is_timer = false;
    described.longest_gap = analysis::kUnbounded;
    const Time period = periods_[callback];
    if (is_one_of(2)) {
      const auto most = static_cast<std::size_t>(period) * 3;
      described.arrivals = analysis::ArrivalCurve::periodic(
          period, static_cast<Time>(between(0, most)), static_cast<Time>(between(0, 5)));
      return;
    }
    std::vector<Time> distances;
    for (std::size_t more = between(1, 3); more > 0; --more) {
      distances.push_back(static_cast<Time>(between(0, static_cast<std::size_t>(period))));
    }
    std::sort(distances.begin(), distances.end());
    distances.push_back(period * static_cast<Time>(distances.size() + 1));
    described.arrivals = analysis::ArrivalCurve::by_distances(distances);
  }
  bool reaches(std::size_t from, std::size_t to) const {
    const auto& outputs = system.callbacks[from].outputs;
    return from == to ||
           std::any_of(outputs.begin(), outputs.end(),
                       [&](const analysis::Output& output) { return reaches(output.to, to); });
  }
  std::size_t add(std::size_t executor, Time period) {
    analysis::Callback callback;
    callback.name = "callback_" + std::to_string(system.callbacks.size());
    callback.executor = executor;
    system.callbacks.push_back(callback);
    periods_.push_back(period);
    return system.callbacks.size() - 1;
  }

  // Utilisations as UUniFast draws them: Bini, Buttazzo, "Measuring the Performance of
  // Schedulability Tests", 2005.
  void set_executions() {
    for (std::size_t executor = 0; executor < system.executors.size(); ++executor) {
      std::vector<std::size_t> mine;
      for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
        if (system.callbacks[i].executor == executor) mine.push_back(i);
      }
      double left = shape_.utilisations[between(0, shape_.utilisations.size() - 1)];
      if (const auto& reservation = system.executors[executor].reservation) {
        left *= static_cast<double>(reservation->budget) / static_cast<double>(reservation->period);
      }
      if (system.executors[executor].share) left /= 2;
      for (std::size_t i = 0; i < mine.size(); ++i) {
        const double next = i + 1 == mine.size()
                                ? 0
                                : left * std::pow(std::uniform_real_distribution<>(0, 1)(random_),
                                                  1.0 / static_cast<double>(mine.size() - 1 - i));
        analysis::Callback& callback = system.callbacks[mine[i]];
        callback.execution = std::max<Time>(
            1, static_cast<Time>((left - next) * static_cast<double>(periods_[mine[i]])));
        callback.least_execution =
            std::max<Time>(1, callback.execution * static_cast<Time>(between(3, 10)) / 10);
        left = next;
      }
    }
  }

  void set_orders() {
    const bool is_picas = is_one_of(2);
    std::size_t group = 0;
    for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
      analysis::Callback& callback = system.callbacks[i];
      callback.place = callback.is_timer ? i : system.callbacks.size() + i;
      callback.urgency = static_cast<std::int64_t>(is_picas ? i : between(1, 5));
      callback.point =
          is_one_of(8) ? analysis::kUnbounded : periods_[i] / 2 * static_cast<Time>(between(1, 4));
      callback.group = group++;
      if (!is_one_of(4)) continue;
      const std::size_t other = between(0, i);
      if (system.callbacks[other].executor == callback.executor) {
        callback.group = system.callbacks[other].group;
      }
    }
  }

  void find_chains(std::vector<std::size_t> path) {
    const auto& outputs = system.callbacks[path.back()].outputs;
    for (const analysis::Output& output : outputs) {
      path.push_back(output.to);
      find_chains(path);
      path.pop_back();
    }
    if (outputs.empty()) {
      system.chains.push_back({"chain_" + std::to_string(system.chains.size()), path});
    }
  }

  std::mt19937_64 random_;
  const Shape shape_;
  std::vector<Time> periods_;  // of the callbacks' first timers
};

/// For a person who has to find out what went wrong.
inline std::string described(const analysis::System& system) {
  std::string text;
  for (const analysis::Executor& executor : system.executors) {
    text +=
        fmt::format("{}: order {}, {}, {} threads", executor.name, static_cast<int>(executor.order),
                    executor.is_wait_set ? "wait set" : "events", executor.threads);
    if (executor.let_period > 0) text += fmt::format(", periods of {}", executor.let_period);
    if (const auto& share = executor.share) {
      text += fmt::format(", CPUs {} priority {}", fmt::join(share->cpus, " "), share->priority);
    }
    if (const auto& reservation = executor.reservation) {
      text += fmt::format(", {} of {}", reservation->budget, reservation->period);
    }
    text += "\n";
  }
  for (const analysis::Callback& callback : system.callbacks) {
    text += fmt::format("{} on {}: {} to {}", callback.name, callback.executor,
                        callback.least_execution, callback.execution);
    if (const auto& arrivals = callback.arrivals) {
      text += fmt::format(" every {}", arrivals->least_distance(2));
    }
    text +=
        fmt::format(", urgency {}, point {}, group {}, sends to", callback.urgency,
                    callback.point >= analysis::kUnbounded ? -1 : callback.point, callback.group);
    for (const analysis::Output& output : callback.outputs) {
      text += fmt::format(" {}{}", output.to, !output.waits ? "" : output.messages ? "&" : "&&");
    }
    text += "\n";
  }
  return text;
}

}  // namespace takt::testing

#endif  // TAKT_TESTING_RANDOM_SYSTEM_HPP_
