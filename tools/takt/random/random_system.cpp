// SPDX-License-Identifier: Apache-2.0
#include "random/random_system.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "takt/base/time.hpp"
#include "takt/executors/executor.hpp"

#include "random/dice.hpp"

namespace takt::tools {
namespace {

using nlohmann::ordered_json;
using std::chrono::microseconds;

struct Thread {
  std::optional<int> cpu;  // nothing: a reservation
  int priority = 0;
  microseconds runtime{0}, period{0};
};

struct Executor {
  std::string type, scheduler;
  microseconds let{0};  // 0: none
  std::vector<Thread> threads;
};

struct Callback {
  std::size_t executor;
  std::optional<std::size_t> sender;  // nothing: a timer
  microseconds period, work{0}, deadline{0};
  std::size_t priority = 0, depth = 0;
  bool sends = false;
};

struct Chain {
  std::vector<std::size_t> path;
  std::size_t priority = 0;
  microseconds deadline{0};
};

class SystemDrawing {
 public:
  explicit SystemDrawing(const RandomOptions& options) : options_(options), dice_(options.seed) {
    const std::size_t chains = dice_.between(1, 6);
    const std::size_t executors = dice_.between(1, std::min<std::size_t>(chains, 4));
    are_reserved_ = dice_.has(15);
    are_urgencies_distinct_ = dice_.has(50);
    for (std::size_t i = 0; i < executors; ++i) add_executor(executors);
    has_short_periods_ = dice_.has(50);
    for (std::size_t i = 0; i < chains; ++i) add_chain();
    for (std::size_t i = 0; i < executors; ++i) set_works(i);
    set_priorities();
  }

  ordered_json document() const;
  double utilisation() const { return utilisation_; }

 private:
  void add_executor(std::size_t count);
  void add_chain();
  void set_works(std::size_t executor);
  void set_priorities();
  ordered_json component(std::size_t index) const;
  std::string name_of(std::size_t callback) const;

  const RandomOptions& options_;
  Dice dice_;
  bool are_reserved_ = false;            // all of them
  bool are_urgencies_distinct_ = false;  // of the threads
  double utilisation_ = 0;
  bool has_short_periods_ = false;  // then a run of 200 ms has seen all there is
  std::vector<Executor> executors_;
  std::vector<Callback> callbacks_;
  std::vector<Chain> chains_;
};

void SystemDrawing::add_executor(std::size_t count) {
  Executor executor{.type = dice_.one_of(options_.executors),
                    .scheduler = dice_.one_of(options_.schedulers)};
  const ExecutorTraits traits = takt::executors().traits(executor.type);
  if (traits.triggered && dice_.has(50)) {
    executor.let = std::chrono::milliseconds(dice_.one_of(std::array{5, 10, 20, 50}));
  }
  const std::size_t cpus = options_.cpus.size();
  if (are_reserved_ && !traits.isolates) {  // one that isolates has a thread for each node
    // Together they stay below what Linux grants.
    const std::size_t percent = dice_.between(10, std::min<std::size_t>(80, 80 * cpus / count));
    const microseconds period = std::chrono::milliseconds(dice_.one_of(std::array{5, 10, 20}));
    executor.threads.push_back({.runtime = period * percent / 100, .period = period});
  } else {
    const std::size_t most = std::min({cpus, traits.max_threads, std::size_t{3}});
    const std::size_t first = dice_.between(0, cpus - 1);
    const auto place = static_cast<int>(executors_.size());
    const int urgency = are_urgencies_distinct_ ? place : static_cast<int>(dice_.between(0, 1));
    for (std::size_t more = dice_.between(1, most); more > 0; --more) {
      executor.threads.push_back(
          {.cpu = options_.cpus[(first + more) % cpus], .priority = 40 + urgency});
    }
  }
  executors_.push_back(std::move(executor));
}

void SystemDrawing::add_chain() {
  Chain chain;
  if (!chains_.empty() && dice_.has(50)) {
    const std::vector<std::size_t>& other = dice_.one_of(chains_).path;
    // Three of five share the timer only, the others fork later.
    const std::size_t most = dice_.has(60) ? 1 : std::min<std::size_t>(other.size(), 3);
    chain.path.assign(other.begin(), other.begin() + dice_.between(1, most));
  }
  // Each executor gets something to do.
  std::size_t executor = chains_.size() % executors_.size();
  const std::size_t length = dice_.between(chain.path.size() + 1, 4);
  while (chain.path.size() < length) {
    Callback callback{.executor = executor};
    if (chain.path.empty()) {
      callback.period = std::chrono::milliseconds(dice_.period_ms(!has_short_periods_));
    } else {
      callback.sender = chain.path.back();
      callbacks_[chain.path.back()].sends = true;
      callback.period = callbacks_[chain.path.back()].period;
    }
    callback.depth = dice_.between(1, 10);
    chain.path.push_back(callbacks_.size());
    callbacks_.push_back(callback);
    if (dice_.has(33)) executor = dice_.between(0, executors_.size() - 1);
  }
  chains_.push_back(std::move(chain));
}

// Utilisations as UUniFast draws them: Bini, Buttazzo, "Measuring the Performance of Schedulability
// Tests", 2005.
void SystemDrawing::set_works(std::size_t executor) {
  double left = 0;
  for (const Thread& thread : executors_[executor].threads) {
    if (!thread.cpu) {
      left +=
          static_cast<double>(thread.runtime.count()) / static_cast<double>(thread.period.count());
      continue;
    }
    std::size_t sharers = 0;
    for (const Executor& other : executors_) {
      sharers += std::count_if(other.threads.begin(), other.threads.end(),
                               [&](const Thread& rival) { return rival.cpu == thread.cpu; });
    }
    left += 1.0 / static_cast<double>(sharers);
  }
  const double utilisation = dice_.one_of(std::array{0.3, 0.5, 0.7, 0.9, 0.97, 1.3});
  utilisation_ = std::max(utilisation_, utilisation);
  left *= utilisation;
  std::vector<Callback*> mine;
  for (Callback& callback : callbacks_) {
    if (callback.executor == executor) mine.push_back(&callback);
  }
  const std::vector<double> shares = dice_.shares(mine.size(), left);
  for (std::size_t i = 0; i < mine.size(); ++i) {
    const double work = shares[i] * static_cast<double>(mine[i]->period.count());
    mine[i]->work = microseconds(std::max<std::int64_t>(1, std::llround(work)));
  }
}

void SystemDrawing::set_priorities() {
  const auto draw_deadline = [this](microseconds period) {
    return dice_.one_of(std::array{period / 2, period, 2 * period});
  };
  for (Callback& callback : callbacks_) {
    callback.priority = dice_.between(1, 5);
    callback.deadline = draw_deadline(callback.period);
  }
  std::vector<std::size_t> order(chains_.size());
  std::iota(order.begin(), order.end(), 0);
  const auto period = [this](std::size_t chain) {
    return callbacks_[chains_[chain].path.front()].period;
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return period(a) > period(b); });
  // Like PiCAS: shorter periods first, and in a chain the later callbacks. What several chains
  // share belongs to the most critical.
  const bool is_picas = dice_.has(50);
  std::size_t chain_priority = 0, callback_priority = 0;
  for (const std::size_t index : order) {
    Chain& chain = chains_[index];
    chain.deadline = draw_deadline(period(index));
    chain.priority = is_picas ? ++chain_priority : dice_.between(1, 5);
    if (!is_picas) continue;
    for (const std::size_t i : chain.path) callbacks_[i].priority = ++callback_priority;
  }
}

std::string topic_of(std::size_t callback) {
  return fmt::format("topic_{}", callback + 1);
}

std::string SystemDrawing::name_of(std::size_t callback) const {
  const auto& sender = callbacks_[callback].sender;
  return sender ? topic_of(*sender) : topic_of(callback) + "_timer";
}

ordered_json SystemDrawing::component(std::size_t index) const {
  const Callback& callback = callbacks_[index];
  ordered_json entities;
  if (!callback.sender) {
    entities["publishers"] = {{"topic", {topic_of(index)}},
                              {"period_us", {callback.period.count()}},
                              {"work_us", {callback.work.count()}},
                              {"depth", {callback.depth}}};
  } else if (callback.sends) {
    entities["relays"] = {{"input", {topic_of(*callback.sender)}},
                          {"output", {topic_of(index)}},
                          {"work_us", {callback.work.count()}},
                          {"depth", {callback.depth}}};
  } else {
    entities["subscriptions"] = {{"topic", {topic_of(*callback.sender)}},
                                 {"work_us", {callback.work.count()}},
                                 {"depth", {callback.depth}}};
  }
  return {{"component", "takt::Workload"},
          {"name", fmt::format("node_{}", index + 1)},
          {"executor", fmt::format("executor_{}", callback.executor + 1)},
          {"parameters", std::move(entities)},
          {"callbacks",
           {{name_of(index),
             {{"priority", callback.priority}, {"deadline", to_string(callback.deadline)}}}}}};
}

ordered_json described(const Thread& thread) {
  if (!thread.cpu) {
    return {{"policy", "SCHED_DEADLINE"},
            {"runtime", to_string(thread.runtime)},
            {"period", to_string(thread.period)}};
  }
  return {{"policy", "SCHED_FIFO"}, {"priority", thread.priority}, {"affinity", {*thread.cpu}}};
}

ordered_json SystemDrawing::document() const {
  ordered_json threads, executors, components, chains;
  for (const Executor& executor : executors_) {
    const std::string name = fmt::format("executor_{}", executors.size() + 1);
    executors[name] = {{"type", executor.type}, {"scheduler", executor.scheduler}};
    if (executor.let != microseconds::zero()) executors[name]["let"] = to_string(executor.let);
    for (const Thread& thread : executor.threads) {
      const std::string thread_name = fmt::format("thread_{}", threads.size() + 1);
      threads[thread_name] = described(thread);
      executors[name]["threads"].push_back(thread_name);
    }
  }
  for (std::size_t i = 0; i < callbacks_.size(); ++i) components.push_back(component(i));
  for (const Chain& chain : chains_) {
    ordered_json path;
    for (const std::size_t i : chain.path) {
      path.push_back(fmt::format("node_{}/{}", i + 1, name_of(i)));
    }
    chains.push_back({{"name", fmt::format("chain_{}", chains.size() + 1)},
                      {"priority", chain.priority},
                      {"deadline", to_string(chain.deadline)},
                      {"path", std::move(path)}});
  }
  return {
      {"threads", std::move(threads)},
      {"executors", std::move(executors)},
      {"container",
       {{"name", fmt::format("random_{}", options_.seed)}, {"components", std::move(components)}}},
      {"chains", std::move(chains)}};
}

}  // namespace

std::vector<std::string> executors_to_draw() {
  std::vector<std::string> names = executors().names();
  std::erase_if(names, [](const std::string& name) { return executors().traits(name).takes_band; });
  return names;
}

RandomSystem random_system(const RandomOptions& options) {
  const SystemDrawing drawing(options);
  return {drawing.document(), drawing.utilisation()};
}

}  // namespace takt::tools
