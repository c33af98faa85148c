// What would help: the system with one thing changed, analysed again.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "takt/base/available_cpus.hpp"

#include "analyze/analyzed_file.hpp"

namespace takt::tools {
namespace {

// Limit: changes that `takt analyze` tries. At it: the rest is not tried. Seen: a line below the
// suggestions.
constexpr std::size_t kMostTried = 300;
// Limit: changes that it shows. At it: the best are shown. Seen: nothing.
constexpr std::size_t kMostShown = 3;

/// How far the chains are from their deadlines: those that miss them, and the sum of bound ÷
/// deadline. The smaller, the better.
using Score = std::pair<std::size_t, double>;

Score score(const SystemModel& model, const ModelBounds& bounds) {
  Score result{0, 0};
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    const auto deadline = static_cast<double>(model.chains[i].deadline.count());
    if (deadline == 0) continue;
    const auto& bound = bounds.chains[i].bound;
    // No bound counts as a very late one.
    const double ratio = bound ? static_cast<double>(bound->count()) / deadline : 1000;
    if (ratio > 1) ++result.first;
    result.second += ratio;
  }
  return result;
}

class Search {
 public:
  Search(const AnalyzedFile& file, Nanoseconds most)
      : file_(file),
        processes_(file.processes),
        before_(score(file.model, file.bounds)),
        most_(most),
        longest_(file.analysis_time) {}

  Suggestions run() {
    if (before_ == Score{0, 0}) return {};  // no deadlines, so nothing to be better at
    for (ModelledProcess& process : processes_) {
      for (ExecutorDescription& executor : process.executors) try_orders(executor);
      for (ThreadAttributes& thread : process.threads) try_threads(thread);
    }
    std::stable_sort(found_.begin(), found_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    Suggestions result{.tried = tried_, .is_complete = !is_over_};
    for (auto& [reached, suggestion] : found_) {
      if (result.found.size() < kMostShown) result.found.push_back(std::move(suggestion));
    }
    return result;
  }

 private:
  void try_orders(ExecutorDescription& executor);
  void try_threads(ThreadAttributes& thread);
  /// Changes `target` to `value`, analyses, and changes it back.
  template <class T>
  void try_value(T& target, const T& value, const std::string& change) {
    if (target == value) return;
    const T old = std::exchange(target, value);
    analyse(change);
    target = old;
  }
  void analyse(const std::string& change);

  using SteadyClock = std::chrono::steady_clock;
  const AnalyzedFile& file_;
  std::vector<ModelledProcess> processes_;
  const Score before_;
  const SteadyClock::time_point begin_ = SteadyClock::now();
  const Nanoseconds most_;
  Nanoseconds longest_;  // analysis so far
  bool is_over_ = false;
  std::size_t tried_ = 0;
  std::vector<std::pair<Score, Suggestion>> found_;
};

void Search::analyse(const std::string& change) {
  const auto begin = SteadyClock::now();
  if (tried_ == kMostTried || begin - begin_ > most_ - longest_) {
    is_over_ = true;
    return;
  }
  ++tried_;
  const SystemModel model =
      make_system_model(file_.system, file_.chains, processes_,
                        file_.measured ? &*file_.measured : nullptr, file_.machine);
  const ModelBounds bounds = analyze(model);
  longest_ = std::max<Nanoseconds>(longest_, SteadyClock::now() - begin);
  const Score reached = score(model, bounds);
  // Five percent of a deadline are worth an edit.
  if (reached.first > before_.first ||
      (reached.first == before_.first && reached.second > before_.second - 0.05)) {
    return;
  }
  Suggestion suggestion{.change = change};
  double most = 0;
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    const auto ratio = [&](const ModelBounds& of) {
      const auto& bound = of.chains[i].bound;
      const auto deadline = static_cast<double>(model.chains[i].deadline.count());
      return deadline == 0 ? 0 : bound ? static_cast<double>(bound->count()) / deadline : 1000;
    };
    const double gain = ratio(file_.bounds) - ratio(bounds);
    if (gain <= most) continue;
    most = gain;
    suggestion.chain = model.chains[i].name;
    suggestion.before = file_.bounds.chains[i].bound;
    suggestion.after = bounds.chains[i].bound;
  }
  found_.emplace_back(reached, std::move(suggestion));
}

void Search::try_orders(ExecutorDescription& executor) {
  const auto& system = file_.model.system;
  const bool is_used =
      std::any_of(system.executors.begin(), system.executors.end(),
                  [&](const auto& used) { return used.name.ends_with(executor.name); });
  if (!is_used) return;
  for (const std::string& type : executors().names()) {
    const ExecutorTraits traits = executors().traits(type);
    if (traits.isolates || traits.triggered || traits.frozen || traits.takes_band ||
        executor.threads.size() > traits.max_threads) {
      continue;
    }
    for (const std::string& scheduler : schedulers().names()) {
      if (schedulers().traits(scheduler).order == analysis::Order::arbitrary) continue;
      ExecutorDescription changed = executor;
      changed.type = type;
      changed.scheduler = scheduler;
      const ExecutorDescription old = executor;
      if (old.type == type && old.scheduler == scheduler) continue;
      executor = changed;
      analyse(
          fmt::format("executors.{}: {{type: {}, scheduler: {}}}", executor.name, type, scheduler));
      executor = old;
    }
  }
}

void Search::try_threads(ThreadAttributes& thread) {
  int highest = 0;
  for (const ModelledProcess& process : processes_) {
    for (const ThreadAttributes& other : process.threads) {
      highest = std::max(highest, other.priority);
    }
  }
  if (thread.priority != 0 && highest < 99) {
    try_value(thread.priority, highest + 1,
              fmt::format("threads.{}.priority: {}", thread.name, highest + 1));
  }
  const auto& machine = file_.system.machine.cpus;
  for (const int cpu : machine.empty() ? usable_cpus() : machine) {
    try_value(thread.affinity, {cpu}, fmt::format("threads.{}.affinity: [{}]", thread.name, cpu));
  }
}

}  // namespace

Suggestions suggestions(const AnalyzedFile& file, Nanoseconds most) {
  return Search(file, most).run();
}

}  // namespace takt::tools
