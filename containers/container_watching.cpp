// A container that compares what it does with what the analysis of its file assumes.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/available_cpus.hpp"
#include "takt/containers/container_parts.hpp"
#include "takt/containers/watching/bound_watch.hpp"

namespace takt {
namespace {

constexpr auto kBetweenLooks = std::chrono::seconds(1);

/// How the CPUs of this process are others than the file states, if some thread may use all.
std::string other_cpus(const SystemDescription& description) {
  const std::set<int> stated(description.machine.cpus.begin(), description.machine.cpus.end());
  const std::set<int> here(available_cpus().begin(), available_cpus().end());
  const bool are_all_bound = std::none_of(
      description.threads.begin(), description.threads.end(),
      [](const ThreadDescription& thread) { return thread.attributes.affinity.empty(); });
  if (stated.empty() || stated == here || are_all_bound) return {};
  return fmt::format("the process may use the CPUs {}, and `machine: cpus` has {}",
                     fmt::join(here, ", "), fmt::join(stated, ", "));
}

}  // namespace

// The executors have the callbacks, but do not run them yet.
void Container::make_bound_watch() {
  std::optional<MeasuredModel> measured;
  if (!description_.model.empty()) measured = read_measured_model(description_.model);
  const ModelledProcess process = modelled();
  const SystemModel model = make_system_model(description_, plan().chains, {&process, 1},
                                              measured ? &*measured : nullptr);
  const ModelBounds bounds = analyze(model);
  const auto has_bound = [](const ModelBounds::Chain& chain) { return chain.bound.has_value(); };
  if (std::none_of(bounds.chains.begin(), bounds.chains.end(), has_bound)) {
    throw Error("no chain has a bound that could be watched", "`takt analyze` says why",
                description_.file);
  }
  for (const auto& chain : chains_) {
    for (std::size_t i = 0; i < model.chains.size(); ++i) {
      if (model.chains[i].name != chain->options().name || !bounds.chains[i].bound) continue;
      chain->watch(*bounds.chains[i].bound);
    }
  }
  auto watch = std::make_unique<BoundWatch>(model, bounds, process);
  if (const std::string other = other_cpus(description_); !other.empty()) watch->differs(other);
  *bound_watch_.lock() = std::move(watch);
  // It may be started otherwise than it was analysed: with another executor, or on other CPUs.
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    const SystemModel::Chain& chain = model.chains[i];
    const ModelBounds::Chain& bound = bounds.chains[i];
    if (chain.deadline == Nanoseconds::zero() || (bound.bound && *bound.bound <= chain.deadline)) {
      continue;
    }
    note(fmt::format("chain '{}' has no guarantee as it runs here: {}", chain.name,
                     bound.bound ? fmt::format("its bound is {}, and its deadline {}",
                                               to_string(*bound.bound), to_string(chain.deadline))
                                 : bound.why_not));
  }
}

std::vector<int> Container::threads_of_callbacks() const {
  std::vector<int> result;
  for (const auto& running : *executors_) {
    if (running->is_own) continue;
    const std::vector<int> its = running->executor->running_threads();
    result.insert(result.end(), its.begin(), its.end());
  }
  return result;
}

void Container::begin_bound_watch() {
  const auto watch = bound_watch_.lock();
  if (*watch == nullptr) return;
  (*watch)->begin(threads_of_callbacks());
  next_look_ = later(Clock::steady().now(), kBetweenLooks);
}

TimePoint Container::watch_bounds() {
  if (Clock::steady().now() < next_look_) return next_look_;
  look_at_bounds();
  return next_look_ = later(Clock::steady().now(), kBetweenLooks);
}

void Container::look_at_bounds(bool is_over) {
  if (next_look_ == kNever) return;
  const auto watch = bound_watch_.lock();
  std::vector<CallbackStatistics> callbacks;
  for (const auto& running : *executors_) {
    if (running->is_own || !running->has_begun.load()) continue;
    for (auto& each : running->executor->statistics()) callbacks.push_back(std::move(each));
  }
  (*watch)->look(threads_of_callbacks(), callbacks, chains_, is_over);
}

void Container::changed(const std::string& what) {
  if (const auto watch = bound_watch_.lock(); *watch != nullptr) (*watch)->changed(what);
}

}  // namespace takt
