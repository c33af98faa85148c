// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container_watching.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/error.hpp"
#include "takt/containers/watching/bound_watch.hpp"

namespace takt {
namespace {

constexpr auto kBetweenLooks = std::chrono::seconds(1);

/// How the CPUs of this process differ from `machine: cpus`; empty: they do not, or all threads
/// have an affinity.
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

ContainerWatch::ContainerWatch(ContainerSetting& setting, const RunningExecutors& running,
                               const Chains& chains)
    : setting_(setting), running_(running), chains_(chains) {
}

ContainerWatch::~ContainerWatch() = default;

void ContainerWatch::make(const ModelledProcess& process,
                          const std::vector<PlannedChain>& planned) {
  std::optional<MeasuredModel> measured;
  if (!setting_.description.model.empty())
    measured = read_measured_model(setting_.description.model);
  const SystemModel model = make_system_model(setting_.description, planned, {&process, 1},
                                              measured ? &*measured : nullptr, facts_of_kernel());
  const ModelBounds bounds = analyze(model);
  const auto has_bound = [](const ModelBounds::Chain& chain) { return chain.bound.has_value(); };
  if (std::none_of(bounds.chains.begin(), bounds.chains.end(), has_bound)) {
    throw Error("no chain has a bound that could be watched", "`takt analyze` says why",
                setting_.description.file);
  }
  for (const auto& chain : chains_) {
    for (std::size_t i = 0; i < model.chains.size(); ++i) {
      if (model.chains[i].name != chain->options().name || !bounds.chains[i].bound) continue;
      chain->watch(*bounds.chains[i].bound);
    }
  }
  auto watch = std::make_unique<BoundWatch>(model, bounds, process);
  if (const std::string other = other_cpus(setting_.description); !other.empty())
    watch->differs(other);
  *watch_.lock() = std::move(watch);
  // The process may run otherwise than it was analysed: with another executor, or on other CPUs.
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    const SystemModel::Chain& chain = model.chains[i];
    const ModelBounds::Chain& bound = bounds.chains[i];
    if (chain.deadline == Nanoseconds::zero() || (bound.bound && *bound.bound <= chain.deadline)) {
      continue;
    }
    setting_.note(fmt::format("chain '{}' has no guarantee as it runs here: {}", chain.name,
                              bound.bound
                                  ? fmt::format("its bound is {}, and its deadline {}",
                                                to_string(*bound.bound), to_string(chain.deadline))
                                  : bound.why_not));
  }
}

void ContainerWatch::begin() {
  const auto watch = watch_.lock();
  if (*watch == nullptr) return;
  (*watch)->begin(running_.threads_of_callbacks());
  next_look_ = later(Clock::steady().now(), kBetweenLooks);
}

TimePoint ContainerWatch::look_in_time() {
  if (Clock::steady().now() < next_look_) return next_look_;
  look();
  return next_look_ = later(Clock::steady().now(), kBetweenLooks);
}

void ContainerWatch::look(bool is_over) {
  if (next_look_ == kNever) return;
  const auto watch = watch_.lock();
  if (setting_.overrides.statistics != StatisticsLevel::off) (*watch)->count_messages();
  std::vector<CallbackStatistics> callbacks;
  for (const auto& running : running_) {
    if (running->is_own || !running->has_begun.load()) continue;
    for (auto& each : running->executor->statistics()) callbacks.push_back(std::move(each));
  }
  (*watch)->look(running_.threads_of_callbacks(), callbacks, chains_, is_over);
}

void ContainerWatch::changed(const std::string& what) {
  if (const auto watch = watch_.lock(); *watch != nullptr) (*watch)->changed(what);
}

void ContainerWatch::add_to(ProcessResult& result) const {
  const auto watch = watch_.lock();
  if (*watch == nullptr) return;
  for (const ProcessResult::Thread& thread : result.threads) {
    const ThreadState& state = thread.statistics.in_force;
    if (!state.refused.empty()) (*watch)->refused(state.name, state.refused);
  }
  result.deviations = (*watch)->found();
  if (const std::string& how = (*watch)->note(); !how.empty()) result.notes.push_back(how);
}

void ContainerWatch::add_to(GetStatistics::Response& now) const {
  const auto watch = watch_.lock();
  if (*watch == nullptr) return;
  now.watches_bounds = true;
  for (const ProcessResult::Deviation& each : (*watch)->found()) {
    now.deviations.push_back(
        {.id = each.id, .text = each.text, .chains = each.chains, .count = each.count});
  }
}

}  // namespace takt
