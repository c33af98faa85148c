// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/scenario_search.hpp"

#include <algorithm>
#include <bit>
#include <iterator>

namespace takt {
namespace {

/// The phase modulo `distance`, never negative.
Nanoseconds within(Nanoseconds phase, Nanoseconds distance) {
  const Nanoseconds rest = phase % distance;
  return rest < Nanoseconds::zero() ? rest + distance : rest;
}

}  // namespace

Scenario ScenarioSearch::next() {
  const std::uint64_t run = runs_++;
  Scenario scenario{.seed = seed_ + run};
  if (run == 0 || releases_.empty()) return scenario;
  if (run % 4 == 1 && missed_ < 2 * releases_.size()) return just_missed();
  if (run % 2 == 1 && !places_.empty()) return climb();
  scenario.phases.clear();
  if (run % 8 == 6) scenario.times = Scenario::Times::drawn;
  return scenario;
}

void ScenarioSearch::add(const SimulatedRun& run, Nanoseconds time_to_begin) {
  just_ = time_to_begin;
  releases_ = run.releases;
  std::vector<Nanoseconds> phases;
  for (const SimulatedRun::Release& release : run.releases) phases.push_back(release.phase);
  const bool is_first = worst_.empty();
  worst_.resize(run.result.chains.size());
  places_.resize(worst_.size());
  for (std::size_t i = 0; i < worst_.size(); ++i) {
    const ProcessResult::ChainResult& chain = run.result.chains[i];
    const Nanoseconds latency = chain.statistics.latency.max();
    // Equal latencies, too: another place on a plateau may lead up.
    if (is_first || latency >= worst_[i].latency)
      places_[i] = {run.scenario, phases, run.moments[i]};
    if (is_first || latency > worst_[i].latency)
      worst_[i] = {chain.name, chain.deadline, latency, run.scenario};
  }
}

std::optional<std::size_t> ScenarioSearch::closest_to_deadline() const {
  const auto part = [](const Worst& of) {
    return static_cast<double>(of.latency.count()) /
           static_cast<double>(std::max(of.deadline, Nanoseconds(1)).count());
  };
  const auto found =
      std::max_element(worst_.begin(), worst_.end(),
                       [&](const Worst& a, const Worst& b) { return part(a) < part(b); });
  if (found == worst_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - worst_.begin());
}

// Releases one callback just after all others, or just before them; each callback in turn.
Scenario ScenarioSearch::just_missed() {
  const SimulatedRun::Release& one = releases_[missed_ / 2];
  const bool is_late = missed_++ % 2 == 0;
  return {.seed = seed_,
          .times = Scenario::Times::worst,
          .phases = {{Scenario::kAll, is_late ? Nanoseconds::zero() : just_},
                     {one.callback, is_late ? just_ : Nanoseconds::zero()}}};
}

Scenario ScenarioSearch::climb() {
  const Place& from = places_[climbs_++ % places_.size()];
  const auto one = static_cast<std::size_t>(draws_.below(std::ssize(releases_)));
  Scenario scenario = from.scenario;
  scenario.phases[releases_[one].callback] = other_phase(from, one);
  return scenario;
}

// Log-uniform: nanoseconds are as likely as milliseconds.
Nanoseconds ScenarioSearch::any_step(Nanoseconds most) {
  const auto bits =
      static_cast<std::int64_t>(std::bit_width(static_cast<std::uint64_t>(most.count())));
  return Nanoseconds(draws_.below(std::int64_t{1} << draws_.below(bits)) + 1);
}

Nanoseconds ScenarioSearch::other_phase(const Place& place, std::size_t of) {
  const Nanoseconds distance = std::max(releases_[of].distance, Nanoseconds(1));
  const std::int64_t way = draws_.below(6);
  if (way == 0) return Nanoseconds(draws_.below(distance.count()));
  if (way == 1 || place.moments.empty()) {
    const Nanoseconds step = any_step(distance);
    return within(place.phases[of] + (draws_.below(2) == 0 ? step : -step), distance);
  }
  const Nanoseconds moment =
      place.moments[static_cast<std::size_t>(draws_.below(std::ssize(place.moments)))];
  const Nanoseconds before = way == 2 ? Nanoseconds::zero() : way == 3 ? just_ : any_step(distance);
  return within(moment - before, distance);
}

}  // namespace takt
